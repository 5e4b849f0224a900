#pragma once
// The relief of the gastric wall: rugae along the organ and areae gastricae, as a height above the
// smooth wall, into the lumen.

#include <cstdint>
#include <string>
#include <vector>

#include "scenes/organ_axis.h"

namespace rugae {

struct ReliefOptions {
  double rugae_height_mm = 3.5;     // of the highest folds; 0: none
  double rugae_thickness_mm = 4.0;  // at half height; folds are 3 to 5 mm thick
  double rugae_spacing_mm = 11.0;   // from fold to fold, on the greater curvature of the body
  double areae_size_mm = 3.0;       // areae gastricae: 1 to 5 mm
  double areae_depth_mm = 0.06;     // of the furrows between them; 0: none
  void check(const std::string& where) const;
};

/// How strongly the wall folds, along the organ: 1 in the body, 0 from the antrum on. Arc lengths
/// of the axis in mm; each pair is where a change begins and ends.
struct FoldZone {
  double rise_from_mm = 0.0, rise_to_mm = 0.0;  // from the fundus' strength to the body's
  double fall_from_mm = 0.0, fall_to_mm = 0.0;  // from the body's to none
  double fundus_strength = 0.5;
  double lesser_strength = 0.2;  // on the lesser curvature, relative to the greater
};

class Relief {
 public:
  /// The folds follow the axis; the axis is not kept.
  Relief(const ReliefOptions& options, const FoldZone& zone, const OrganAxis& axis,
         std::uint64_t seed);

  /// Height in mm into the lumen, at `p` on the smooth wall, seen from the axis as `at`.
  double height_mm(const Vec3& p, const AxisPoint& at) const {
    return rugae_mm(p, at) + areae_mm(p);
  }
  double rugae_mm(const Vec3& p, const AxisPoint& at) const;
  double areae_mm(const Vec3& p) const;  // 0 on the areae, negative in the furrows
  /// Share of the full fold height, 0 to 1.
  double strength(const AxisPoint& at) const;

 private:
  // A few parallel folds that fade out around their middle.
  struct Kernel {
    Vec3 centre, across, along;  // unit directions
    double folds_per_mm, phase_turns;
  };
  const std::vector<int>* near(const Vec3& p) const;

  ReliefOptions options_;
  FoldZone zone_;
  std::uint32_t wave_seed_, vary_seed_, areae_seed_;
  std::vector<Kernel> kernels_;
  // Indices of the kernels that reach into each box of a grid.
  Vec3 grid_origin_ = Vec3::Zero();
  Vec3i grid_size_ = Vec3i::Zero();
  std::vector<std::vector<int>> grid_;
};

}  // namespace rugae
