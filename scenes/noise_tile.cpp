#include "scenes/noise_tile.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace rugae {

NoiseTile::NoiseTile(const std::function<Channels(const Vec3&)>& value, const Channels& range)
    : voxels_(4u * kVoxels * kVoxels * kVoxels) {
  constexpr float kLargest = 32767.0f;
  for (int c = 0; c < 4; ++c) step_[c] = range[c] / kLargest;
  tbb::parallel_for(0, kVoxels, [&](int z) {
    std::int16_t* out = voxels_.data() + 4 * kVoxels * kVoxels * z;
    for (int y = 0; y < kVoxels; ++y)
      for (int x = 0; x < kVoxels; ++x)
        for (const float v : value(Vec3(x, y, z) * (static_cast<double>(kCells) / kVoxels))) {
          const float r = range[(out - voxels_.data()) & 3];
          *out++ =
              static_cast<std::int16_t>(std::lround(std::clamp(v / r, -1.0f, 1.0f) * kLargest));
        }
  });
}

}  // namespace rugae
