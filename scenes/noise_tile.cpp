#include "scenes/noise_tile.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace rugae {

NoiseTile::NoiseTile(const std::function<Channels(const Vec3&)>& value, const Channels& range)
    : voxels_(std::size_t{4} * kRow * kVoxels * kVoxels) {
  constexpr float kLargest = 32767.0f;
  for (int c = 0; c < 4; ++c) step_[c] = range[c] / (kLargest * kWeights);
  tbb::parallel_for(0, kVoxels, [&](int z) {
    for (int y = 0; y < kVoxels; ++y) {
      std::int16_t* row = voxels_.data() + 4 * kRow * (y + kVoxels * z);
      for (int x = 0; x < kVoxels; ++x) {
        const Channels v = value(Vec3(x, y, z) * (static_cast<double>(kCells) / kVoxels));
        for (int c = 0; c < 4; ++c)
          row[4 * x + c] = static_cast<std::int16_t>(
              std::lround(std::clamp(v[c] / range[c], -1.0f, 1.0f) * kLargest));
      }
      std::copy(row, row + 4, row + 4 * kVoxels);
    }
  });
}

}  // namespace rugae
