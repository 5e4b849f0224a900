#include "scenes/relief.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"
#include "core/random.h"
#include "scenes/lattice_noise.h"
#include "scenes/portable_math.h"

namespace rugae {
namespace {

// A fold runs this many times farther along the organ than across before it turns or joins another.
constexpr double kElongation = 3.5;
// Zero crossings of the fold noise lie this many cells apart across the folds (measured on the
// noise).
constexpr double kCellsPerFold = 1.108;
constexpr double kMeanderMm = 9.0, kMeanderLengthMm = 50.0;

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

Relief::Relief(const ReliefOptions& options, const FoldZone& zone, std::uint64_t seed)
    : options_(options), zone_(zone) {
  const auto words = random_words(seed, Purpose::scene_relief, 0, 0);
  fold_seed_ = words[0];
  bend_seed_ = words[1];
  vary_seed_ = words[2];
  areae_seed_ = words[3];
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

// Folds lie where a noise, stretched along the organ, crosses zero: such lines run along, meander,
// part and meet. The distance to the line is |n| / |grad n| to first order, which makes every fold
// equally thick; where two lines meet, the gradient vanishes and the fold widens into a junction.
double Relief::rugae_mm(const Vec3& p, const AxisPoint& at) const {
  const double share = strength(at);
  if (!(share > 0.0) || !(options_.rugae_height_mm > 0.0)) return 0.0;
  const double cell = options_.rugae_spacing_mm / kCellsPerFold;

  // meandering: the cross-section is shifted by slow noises
  const NoiseSample shift_a = gradient_noise(p / kMeanderLengthMm, bend_seed_);
  const NoiseSample shift_b = gradient_noise(p / kMeanderLengthMm, bend_seed_ + 1);
  const Vec3 q((at.greater_mm + kMeanderMm * shift_a.value) / cell,
               (at.side_mm + kMeanderMm * shift_b.value) / cell, at.s_mm / (cell * kElongation));

  // two noises turned against each other hide the lattice
  const Mat3 turn = (Mat3() << 0.8, -0.6, 0.0, 0.6, 0.8, 0.0, 0.0, 0.0, 1.0).finished();
  const NoiseSample n0 = gradient_noise(q, fold_seed_);
  const NoiseSample n1 = gradient_noise(1.21 * (turn * q) + Vec3(17.3, 5.1, 9.7), fold_seed_ + 1);
  const double n = n0.value + 0.8 * n1.value;
  const Vec3 g = n0.gradient + 0.8 * 1.21 * (turn.transpose() * n1.gradient);

  // its gradient in space by the chain rule, and of that the part along the wall
  constexpr double kShear = kMeanderMm / kMeanderLengthMm;
  const Vec3 in_space =
      (g.x() * (at.greater + kShear * shift_a.gradient) +
       g.y() * (at.side + kShear * shift_b.gradient) + g.z() / kElongation * at.along) /
      cell;
  const Vec3 normal = at.gradient.normalized();
  const double steep = (in_space - normal * normal.dot(in_space)).norm();
  constexpr double kLeastSlope = 0.35;  // in noise units a cell: limits the width of junctions
  const double slope = std::sqrt(steep * steep + kLeastSlope * kLeastSlope / (cell * cell));
  const double distance = std::abs(n) / slope;

  // soft-topped profile (1 - (d/w)^2)^2, half as high at d = w sqrt(1 - sqrt(1/2)) = 0.541 w
  const NoiseSample vary = gradient_noise(p / 27.0, vary_seed_);
  const double w = options_.rugae_thickness_mm / (2.0 * 0.5412) * (1.0 + 0.2 * vary.value);
  if (distance >= w) return 0.0;
  const double t = 1.0 - (distance / w) * (distance / w);
  const NoiseSample height = gradient_noise(p / 19.0, vary_seed_ + 1);
  // small closed lines, where the noise barely crosses zero, would be warts: they fade
  const double drawn = smooth_step(0.35, 0.9, cell * steep);
  return options_.rugae_height_mm * share * drawn * std::min(1.0, 0.85 + 0.4 * height.value) * t *
         t;
}

// Furrows run where the two nearest feature points are equally far.
double Relief::areae_mm(const Vec3& p) const {
  if (!(options_.areae_depth_mm > 0.0)) return 0.0;
  const CellSample cell = cell_noise(p / options_.areae_size_mm, areae_seed_);
  const double flat = smooth_step(0.0, 0.30, cell.second - cell.nearest);
  return options_.areae_depth_mm * (flat - 1.0);
}

}  // namespace rugae
