#include "scenes/region_tint.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>

namespace rugae {
namespace {

constexpr double kStepMm = 5.0;
constexpr int kBlurs = 3;  // rounds of (1 2 1) / 4: transitions about 2 cm long

// Relative to the body. Endoscopists describe the gastric body as pink to salmon with rugae, the
// antrum as paler and smooth, the fundus as thin-walled with visible submucosal vessels, the
// duodenal bulb as yellowish; the values are assumed.
using Tint = std::array<float, 4>;  // red, green, blue, vessels
Tint tint_of(Region region) {
  switch (region) {
    case Region::cardia:
    case Region::oesophagus:
      return {1.00f, 1.08f, 1.14f, 0.8f};
    case Region::fundus:
      return {0.97f, 1.02f, 1.12f, 1.0f};
    case Region::incisura:
      return {1.02f, 1.08f, 1.06f, 0.5f};
    case Region::antrum:
      return {1.04f, 1.15f, 1.18f, 0.35f};
    case Region::pylorus:
      return {1.03f, 1.08f, 1.05f, 0.2f};
    case Region::duodenum:
      return {1.02f, 1.16f, 0.95f, 0.1f};
    case Region::body:
    case Region::unknown:
      break;
  }
  return {1.0f, 1.0f, 1.0f, 0.4f};
}

}  // namespace

RegionTint::RegionTint(const Eigen::AlignedBox3d& box,
                       const std::function<Region(const Vec3&)>& region_at)
    : origin_(box.min().cast<float>()) {
  for (int a = 0; a < 3; ++a) size_[a] = static_cast<int>(std::ceil(box.sizes()[a] / kStepMm)) + 1;
  nodes_.resize(4 * static_cast<std::size_t>(size_.prod()));
  tbb::parallel_for(0, size_.z(), [&](int z) {
    for (int y = 0; y < size_.y(); ++y)
      for (int x = 0; x < size_.x(); ++x) {
        const Tint tint = tint_of(region_at(box.min() + kStepMm * Vec3(x, y, z)));
        std::copy(tint.begin(), tint.end(),
                  &nodes_[4 * (x + size_.x() * (y + static_cast<std::size_t>(size_.y()) * z))]);
      }
  });
  const std::size_t strides[3] = {4, 4 * static_cast<std::size_t>(size_.x()),
                                  4 * static_cast<std::size_t>(size_.x()) * size_.y()};
  std::vector<float> blurred(nodes_.size());
  for (int round = 0; round < kBlurs; ++round)
    for (int axis = 0; axis < 3; ++axis) {
      const std::size_t stride = strides[axis];
      for (std::size_t i = 0; i < nodes_.size(); ++i) {
        const auto place = static_cast<int>(i / stride % static_cast<std::size_t>(size_[axis]));
        const float before = place > 0 ? nodes_[i - stride] : nodes_[i];
        const float after = place + 1 < size_[axis] ? nodes_[i + stride] : nodes_[i];
        blurred[i] = 0.25f * before + 0.5f * nodes_[i] + 0.25f * after;
      }
      nodes_.swap(blurred);
    }
}

Lanes RegionTint::fetch(Lanes rest_position_mm) const {
  const Lanes cells =
      (rest_position_mm - lanes(origin_)) * splat(static_cast<float>(1.0 / kStepMm));
  alignas(16) float p[4];
  _mm_store_ps(p, cells);
  int whole[3];
  float part[3];
  for (int a = 0; a < 3; ++a) {
    const float inside = std::clamp(p[a], 0.0f, static_cast<float>(size_[a] - 1));
    whole[a] = std::min(static_cast<int>(inside), size_[a] - 2);
    part[a] = inside - static_cast<float>(whole[a]);
  }
  const auto mix = [](Lanes a, Lanes b, float t) { return a + splat(t) * (b - a); };
  const auto plane = [&](int z) {
    const int x = whole[0], y = whole[1];
    return mix(mix(at(x, y, z), at(x + 1, y, z), part[0]),
               mix(at(x, y + 1, z), at(x + 1, y + 1, z), part[0]), part[1]);
  };
  return mix(plane(whole[2]), plane(whole[2] + 1), part[2]);
}

}  // namespace rugae
