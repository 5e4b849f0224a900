#include "cameras/row_poses.h"

#include <algorithm>

#include "core/check.h"

namespace rugae {

RowPoses::RowPoses(std::vector<Rigid3> world_from_camera, double row_time_s)
    : poses_(std::move(world_from_camera)), row_time_s_(row_time_s) {
  check(poses_.size() >= 3, "row poses: {} of them, expected at least 3", poses_.size());
  check(row_time_s > 0.0, "row poses: the row time is {} s, expected above 0", row_time_s);
  // q and -q are one rotation; neighbours are to lie on the same side.
  for (std::size_t k = 1; k < poses_.size(); ++k)
    if (poses_[k].rotation.dot(poses_[k - 1].rotation) < 0.0) poses_[k].rotation.coeffs() *= -1.0;
}

Rigid3 RowPoses::at(double v) const {
  if (!rolling()) return poses_.front();
  const double u = held(v) + 0.5;  // 0 at the centre of row -1
  const auto k = std::min(static_cast<std::size_t>(u), poses_.size() - 2);
  const double share = u - static_cast<double>(k);
  const Rigid3 &a = poses_[k], &b = poses_[k + 1];
  Quat q;
  q.coeffs() = a.rotation.coeffs() + share * (b.rotation.coeffs() - a.rotation.coeffs());
  return {q.normalized(), a.translation + share * (b.translation - a.translation)};
}

double RowPoses::offset_s(double v) const {
  return rolling() ? (held(v) - 0.5 * height()) * row_time_s_ : 0.0;
}

}  // namespace rugae
