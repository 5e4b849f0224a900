#pragma once
// A human stomach without a patient: its smooth shape, its regions, its relief.

#include <cstdint>
#include <string>

#include "scenes/deformation.h"
#include "scenes/instances.h"
#include "scenes/relief.h"
#include "scenes/scene.h"

namespace rugae {

struct StomachOptions {
  double scale = 1.0;      // of all lengths of the smooth shape; 1: about 1.5 l
  double variation = 1.0;  // how far a seed's stomach may be from the mean one, 0 to 1
  ReliefOptions relief;
  InstanceOptions instances;
  void check(const std::string& where) const;
};

/// The smooth stomach. Axes: x to the patient's left, y to the back, z up; the cardia is near the
/// origin. Lengths in mm.
class StomachShape {
 public:
  /// The mean stomach, bent, stretched and widened as the seed draws it: the hook of the J by up to
  /// 14 degrees, its length by 6 %, its calibre by 6 % as a whole and 7 % from one end to the other
  /// (the pyloric canal by 15 %), its volume by 10 %; assumed.
  StomachShape(const StomachOptions& options, std::uint64_t seed);
  double distance_mm(const Vec3& p, Vec3* gradient = nullptr) const;
  /// Coordinates along and around the main axis, fundus to duodenum.
  AxisPoint locate(const Vec3& p) const { return axis_.locate(p); }
  Region region(const Vec3& p, const AxisPoint& at) const;
  FoldZone fold_zone() const;
  PeristalsisZone peristalsis_zone() const;
  const OrganAxis& axis() const { return axis_; }
  Eigen::AlignedBox3d box() const;
  /// From the top of the fundus to the pylorus along the axis.
  double length_mm() const;

 private:
  double scale_, top_radius_mm_;  // of the dome of the fundus
  OrganAxis axis_, oesophagus_;
};

struct StomachWall {
  TriangleMesh mesh;  // closed, with vertex normals, outward
  std::vector<Region> regions;
  std::vector<WallInstance> instances;
};

/// `cell_mm` sets the triangle size: about 3 area / cell^2 triangles. The seed draws the shape, the
/// folds (height by up to 20 %, spacing and thickness by 10 %) and what lies on them; it gives the
/// same surface at every cell size. Throws Error when the lesions and objects find no room.
StomachWall make_stomach(const StomachOptions& options, std::uint64_t seed, double cell_mm);

}  // namespace rugae
