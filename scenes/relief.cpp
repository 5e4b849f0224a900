#include "scenes/relief.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"
#include "core/portable_math.h"
#include "core/random.h"
#include "scenes/lattice_noise.h"

namespace rugae {
namespace {

// Lengths below are in units of the spacing of folds: kernels reach so far across the folds and
// along them, and stand so far apart. A fold keeps its course over about the reach along.
constexpr double kReachAcross = 2.2, kReachAlong = 4.4, kKernelStep = 1.5;
constexpr double kMeanderRad = 0.9;  // of the direction, for a noise of one
constexpr double kMeanderLengthMm = 45.0;
constexpr double kWaveMm = 3.0, kWaveLengthMm = 17.0;  // the short bends of each fold

}  // namespace

void ReliefOptions::check(const std::string& where) const {
  const auto within = [&](const char* name, double value, double low, double high) {
    rugae::check(value >= low && value <= high, "{}: {} is {}, expected {} to {}", where, name,
                 value, low, high);
  };
  within("rugae_height_mm", rugae_height_mm, 0.0, 12.0);
  within("rugae_thickness_mm", rugae_thickness_mm, 1.0, 15.0);
  within("rugae_spacing_mm", rugae_spacing_mm, 3.0, 60.0);
  within("areae_size_mm", areae_size_mm, 0.5, 10.0);
  within("areae_depth_mm", areae_depth_mm, 0.0, 1.0);
}

Relief::Relief(const ReliefOptions& options, const FoldZone& zone, const OrganAxis& axis,
               std::uint64_t seed)
    : options_(options), zone_(zone) {
  const auto words = random_words(seed, Purpose::scene_relief, 0, 0);
  wave_seed_ = words[0];
  vary_seed_ = words[1];
  areae_seed_ = words[2];
  if (!(options.rugae_height_mm > 0.0)) return;

  // one kernel a box of a jittered lattice around the axis
  const double spacing = options.rugae_spacing_mm, step = kKernelStep * spacing;
  const double reach = kReachAlong * spacing;
  Eigen::AlignedBox3d box = axis.box();
  box.min() -= Vec3::Constant(step);
  box.max() += Vec3::Constant(step);
  const Vec3i count = (box.sizes() / step).array().ceil().cast<int>();
  std::uint64_t index = 0;
  for (int z = 0; z < count.z(); ++z)
    for (int y = 0; y < count.y(); ++y)
      for (int x = 0; x < count.x(); ++x, ++index) {
        const auto u = random_uniform(seed, Purpose::scene_relief, 1, index);
        const auto v = random_uniform(seed, Purpose::scene_relief, 2, index);
        Kernel k;
        k.centre = box.min() + step * Vec3(x + u[0], y + u[1], z + u[2]);
        k.phase_turns = u[3];
        k.folds_per_mm = (0.9 + 0.2 * v[0]) / spacing;
        const AxisPoint at = axis.locate(k.centre);
        if (std::abs(at.distance_mm) > 2.0 * step) continue;
        // around the organ, turned a little within the wall
        const Vec3 outward = at.gradient.normalized();
        const Vec3 along = (at.along - outward * outward.dot(at.along)).normalized();
        const Vec3 across = along.cross(outward);
        const double turn =
            kMeanderRad * gradient_noise(k.centre / kMeanderLengthMm, words[3]).value / (2.0 * kPi);
        const SineCosine sc = portable_turn(turn);
        k.across = sc.cosine * across + sc.sine * along;
        k.along = sc.cosine * along - sc.sine * across;
        kernels_.push_back(k);
      }

  grid_origin_ = box.min() - Vec3::Constant(reach);
  grid_size_ = ((box.sizes() + Vec3::Constant(2.0 * reach)) / step).array().ceil().cast<int>();
  grid_.resize(static_cast<std::size_t>(grid_size_.prod()));
  for (std::size_t i = 0; i < kernels_.size(); ++i) {
    const Vec3 corner = kernels_[i].centre - grid_origin_;
    const Vec3i low = ((corner - Vec3::Constant(reach)) / step).array().floor().cast<int>();
    const Vec3i high = ((corner + Vec3::Constant(reach)) / step).array().floor().cast<int>();
    for (int z = std::max(0, low.z()); z <= std::min(high.z(), grid_size_.z() - 1); ++z)
      for (int y = std::max(0, low.y()); y <= std::min(high.y(), grid_size_.y() - 1); ++y)
        for (int x = std::max(0, low.x()); x <= std::min(high.x(), grid_size_.x() - 1); ++x)
          grid_[x + grid_size_.x() * (y + grid_size_.y() * z)].push_back(static_cast<int>(i));
  }
}

const std::vector<int>* Relief::near(const Vec3& p) const {
  const double step = kKernelStep * options_.rugae_spacing_mm;
  const Vec3 cell = (p - grid_origin_) / step;
  for (int a = 0; a < 3; ++a)
    if (!(cell[a] >= 0.0 && cell[a] < grid_size_[a])) return nullptr;
  const Vec3i c = cell.cast<int>();
  return &grid_[c.x() + grid_size_.x() * (c.y() + grid_size_.y() * c.z())];
}

double Relief::strength(const AxisPoint& at) const {
  const double rise = smooth_step(zone_.rise_from_mm, zone_.rise_to_mm, at.s_mm);
  const double fall = smooth_step(zone_.fall_to_mm, zone_.fall_from_mm, at.s_mm);
  const double along = (zone_.fundus_strength + (1.0 - zone_.fundus_strength) * rise) * fall;
  // full to 60 degrees off the greater curvature, then down to the lesser
  const double around = smooth_step(-0.9, 0.5, at.cos_greater);
  // narrow stubs have no room for folds
  const double off_axis = std::sqrt(at.greater_mm * at.greater_mm + at.side_mm * at.side_mm);
  const double room = smooth_step(5.0, 14.0, off_axis);
  return room * along * (zone_.lesser_strength + (1.0 - zone_.lesser_strength) * around);
}

// Folds are the crests of a phasor noise (Tricard et al., Procedural phasor noise, TOG 2019,
// doi:10.1145/3306346.3322990): short wave trains across the organ, of random phase, are added as
// complex numbers, and only the phase of the sum is kept. Crests are evenly spaced, run along the
// organ, bend where the trains' directions do, and part or end where the sum vanishes.
double Relief::rugae_mm(const Vec3& p, const AxisPoint& at) const {
  const double share = strength(at);
  const std::vector<int>* kernels = share > 0.0 && !grid_.empty() ? near(p) : nullptr;
  if (!kernels) return 0.0;
  const double spacing = options_.rugae_spacing_mm;
  const Vec3 wave = p / kWaveLengthMm;
  const Vec3 q = p + kWaveMm * Vec3(gradient_noise(wave, wave_seed_).value,
                                    gradient_noise(wave, wave_seed_ + 1).value,
                                    gradient_noise(wave, wave_seed_ + 2).value);
  double real = 0.0, imaginary = 0.0, total = 0.0;
  const double across_scale = 1.0 / (kReachAcross * spacing),
               along_scale = 1.0 / (kReachAlong * spacing);
  for (const int i : *kernels) {
    const Kernel& k = kernels_[i];
    const Vec3 from = q - k.centre;
    const double u = from.dot(k.across), v = from.dot(k.along);
    const double through = from.squaredNorm() - u * u - v * v;
    const double far =
        (u * u + through) * across_scale * across_scale + v * v * along_scale * along_scale;
    if (far >= 1.0) continue;
    const double weight = (1.0 - far) * (1.0 - far);
    const SineCosine sc = portable_turn(u * k.folds_per_mm + k.phase_turns);
    real += weight * sc.cosine;
    imaginary += weight * sc.sine;
    total += weight * weight;
  }
  const double size = std::sqrt(real * real + imaginary * imaginary);
  if (!(size > 1e-9)) return 0.0;

  // distance to the crest from the cosine of the phase: 2 sin(phase / 2) = sqrt(2 - 2 cos)
  const double distance = spacing / (2.0 * kPi) * std::sqrt(std::max(0.0, 2.0 - 2.0 * real / size));
  // soft-topped profile (1 - (d/w)^2)^2, half as high at d = w sqrt(1 - sqrt(1/2)) = 0.541 w
  const NoiseSample vary = gradient_noise(p / 27.0, vary_seed_);
  const double w = options_.rugae_thickness_mm / (2.0 * 0.5412) * (1.0 + 0.2 * vary.value);
  if (distance >= w) return 0.0;
  const double t = 1.0 - (distance / w) * (distance / w);
  // where the sum is small against what random phases give, the crests part or end: low there
  const double drawn = smooth_step(0.15, 1.2, size / std::sqrt(total));
  const NoiseSample height = gradient_noise(p / 19.0, vary_seed_ + 1);
  return options_.rugae_height_mm * share * drawn * std::min(1.0, 0.85 + 0.4 * height.value) * t *
         t;
}

// Furrows run where the two nearest feature points are equally far.
double Relief::areae_mm(const Vec3& p) const {
  if (!(options_.areae_depth_mm > 0.0)) return 0.0;
  const CellSample cell = cell_noise(p / options_.areae_size_mm, areae_seed_);
  const double flat = smooth_step(0.0, 0.24, cell.second - cell.nearest);
  return options_.areae_depth_mm * (flat - 1.0);
}

}  // namespace rugae
