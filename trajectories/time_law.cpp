#include "trajectories/time_law.h"

#include <algorithm>
#include <cmath>

#include "core/portable_math.h"
#include "core/random.h"
#include "trajectories/channels.h"

namespace rugae {

TimeLaw::TimeLaw(const PaceOptions& pace, std::uint64_t seed) {
  if (pace.bursts == 0 || pace.burst_share == 0.0) return;
  // A lobe cos^2(pi x / (2 width)) over |x| < width has the area `width`, which is also its full
  // width at half height. Mean 1: base + (peak - base) share = 1.
  width_ = pace.burst_share / pace.bursts;
  peak_ = pace.peak_speed;
  base_ = (1.0 - peak_ * pace.burst_share) / (1.0 - pace.burst_share);
  const double slot = 1.0 / pace.bursts;
  for (int k = 0; k < pace.bursts; ++k) {
    const double u = random_uniform(seed, Purpose::trajectory, kChannelBursts, k)[0];
    centers_.push_back(slot * k + width_ + u * (slot - 2.0 * width_));
  }
}

double TimeLaw::share(double fraction) const {
  // Integral of cos^2(pi x / (2 w)) from -w to x: (x + w)/2 + w/(2 pi) sin(pi x / w).
  double bumps = 0.0;
  for (const double center : centers_) {
    const double x = std::clamp(fraction - center, -width_, width_);
    bumps += 0.5 * (x + width_) + width_ / (2.0 * kPi) * portable_sin_cos(kPi * x / width_).sine;
  }
  return std::clamp(base_ * fraction + (peak_ - base_) * bumps, 0.0, 1.0);
}

}  // namespace rugae
