#include "scenes/region_tint.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstdint>

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

Float4x4 RegionTint::fetch(const Float4x3& p) const {
  // whole node below and the share of the next, along one axis
  struct Axis {
    alignas(16) std::array<std::int32_t, 4> node;
    alignas(16) std::array<float, 4> part;
  };
  const auto axis = [](Float4 position, float origin, int size) {
    const Float4 cells = (position - splat(origin)) * splat(static_cast<float>(1.0 / kStepMm));
    const Float4 inside = min(max(cells, _mm_setzero_ps()), splat(static_cast<float>(size - 1)));
    const Float4 below =
        _mm_cvtepi32_ps(_mm_cvttps_epi32(min(inside, splat(static_cast<float>(size - 2)))));
    Axis a;
    _mm_store_si128(reinterpret_cast<__m128i*>(a.node.data()), _mm_cvttps_epi32(below));
    _mm_store_ps(a.part.data(), inside - below);
    return a;
  };
  const Axis x = axis(p.x, origin_.x(), size_.x()), y = axis(p.y, origin_.y(), size_.y()),
             z = axis(p.z, origin_.z(), size_.z());
  const auto mix = [](Float4 a, Float4 b, Float4 t) { return a + t * (b - a); };
  const int up = 4 * size_.x(), deep = up * size_.y();
  Float4 each[4];
  for (int i = 0; i < 4; ++i) {
    const Float4 fx = splat(x.part[i]), fy = splat(y.part[i]), fz = splat(z.part[i]);
    const float* const near =
        &nodes_[static_cast<std::size_t>(4 * x.node[i] + up * y.node[i] + deep * z.node[i])];
    const auto along = [&mix, fx](const float* first) {
      return mix(_mm_loadu_ps(first), _mm_loadu_ps(first + 4), fx);
    };
    const auto plane = [&](const float* first) { return mix(along(first), along(first + up), fy); };
    each[i] = mix(plane(near), plane(near + deep), fz);
  }
  return transposed(each[0], each[1], each[2], each[3]);
}

}  // namespace rugae
