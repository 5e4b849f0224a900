#include "scenes/noise_tile.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace rugae {

NoiseTile::NoiseTile(const std::function<Channels(const Vec3&)>& value, const Channels& range)
    : voxels_(std::size_t{4} * kStored * kStored * kStored) {
  constexpr float kLargest = 32767.0f;
  for (int c = 0; c < 4; ++c) step_[c] = range[c] / (kLargest * kWeights);
  tbb::parallel_for(0, kStored, [&](int z) {
    for (int y = 0; y < kStored; ++y)
      for (int x = 0; x < kStored; ++x) {
        const Channels v = value(Vec3(x, y, z) * (static_cast<double>(kCells) / kVoxels));
        std::int16_t* const voxel = voxels_.data() + 4 * x + kNextY * y + kNextZ * z;
        for (int c = 0; c < 4; ++c)
          voxel[c] = static_cast<std::int16_t>(
              std::lround(std::clamp(v[c] / range[c], -1.0f, 1.0f) * kLargest));
      }
  });
}

}  // namespace rugae
