#include "dataset/turn_search.h"

#include <algorithm>

#include "core/units.h"

namespace rugae {

Quat rotation_of(const Vec3& turn_rad) {
  const double angle = turn_rad.norm();
  return Quat(Eigen::AngleAxisd(angle, angle > 0.0 ? Vec3(turn_rad / angle) : Vec3(Vec3::UnitX())));
}

Turns best_turns(const std::function<std::vector<double>(const Turns&)>& errors_of) {
  // the mean of errors that are cut off falls more smoothly than their median
  const auto error_of = [&](const Turns& turns) {
    const std::vector<double> errors = errors_of(turns);
    constexpr double kCut = 0.1, kFew = 40.0;
    double sum = kCut * std::max(0.0, kFew - static_cast<double>(errors.size()));
    for (const double e : errors) sum += std::min(e, kCut);
    return sum / std::max(kFew, static_cast<double>(errors.size()));
  };
  Turns best = Turns::Zero();
  double least = error_of(best);
  for (int start = 0; start < 7; ++start) {
    Turns turns = Turns::Zero();
    if (start > 0) turns[3 + (start - 1) / 2] = start % 2 == 0 ? -0.5 * kPi : 0.5 * kPi;
    double error = error_of(turns);
    for (double step_rad = rad_from_deg(16.0); step_rad > rad_from_deg(1.0 / 16.0);) {
      bool better = false;
      for (int k = 0; k < 12; ++k) {
        Turns next = turns;
        next[k / 2] += k % 2 == 0 ? step_rad : -step_rad;
        if (const double e = error_of(next); e < error) {
          error = e;
          turns = next;
          better = true;
        }
      }
      if (!better) step_rad *= 0.5;
    }
    if (error < least) {
      least = error;
      best = turns;
    }
  }
  return best;
}

}  // namespace rugae
