#pragma once
// Single things on the wall, each with an id: lesions, which belong to it, and objects, which lie
// on it. Where one begins and ends is a function of the rest position alone, the same for the
// wall's shape, for its colour and for the labels.

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/types.h"
#include "scenes/scene.h"

namespace rugae {

enum class InstanceKind : std::uint8_t {
  polyp,        // sessile: a dome of the wall
  ulcer,        // a crater with a fibrin base and a raised red rim
  erosion,      // flat, with a small pale base and a red halo
  bleeding,     // fresh blood
  angiectasia,  // a tuft of dilated vessels
  debris,       // a lump of food, opaque: part of the wall's shape
  bubble,       // a transparent dome on the wall: it shines, and the wall is seen through it
  mucus,        // a pool, whitish and thin
};
inline constexpr std::array kInstanceKinds = {"polyp",       "ulcer",  "erosion", "bleeding",
                                              "angiectasia", "debris", "bubble",  "mucus"};
std::string instance_name(InstanceKind kind);

struct WallInstance {
  int id = 0;  // 1 to 255
  InstanceKind kind = InstanceKind::polyp;
  Vec3 centre_mm = Vec3::Zero();  // on the wall at rest with its folds, below what it raises
  Vec3 inward = Vec3::UnitZ();    // unit; what it raises, it raises along this
  double radius_mm = 1.0;         // its outline varies around this
  double height_mm = 0.0;         // of its highest point above the wall
  Region region = Region::unknown;
  std::uint32_t outline = 0;  // seed of the outline
  double irregularity = 0.0;  // of the outline, a share of the radius
};

struct InstanceOptions {
  int polyp = 0, ulcer = 0, erosion = 0, bleeding = 0, angiectasia = 0;  // lesions
  int debris = 0, bubbles = 0;                                           // objects
  double mucus = 0.0;  // share of the wall under pools of mucus, at most 0.2
  /// Throws Error naming `where` and the field.
  void check(const std::string& where) const;
};

/// A place for an instance: on the smooth wall, with what the wall is there.
struct WallPlace {
  Vec3 p_mm;    // with the folds' height
  Vec3 inward;  // unit, across the smooth wall
  Region region = Region::unknown;
};
/// The nearest place on the wall, from a point near it; false where there is none.
using PlaceOnWall = std::function<bool(const Vec3& near_mm, WallPlace& place)>;

/// Draws the instances by `seed`, taking fundus, body and antrum in turn, so that none touches
/// another. `area_mm2` is the wall's. Throws Error naming `where` when they do not all fit.
std::vector<WallInstance> place_instances(const InstanceOptions& options,
                                          const Eigen::AlignedBox3d& box, double area_mm2,
                                          const PlaceOnWall& place, std::uint64_t seed,
                                          const std::string& where);

class Instances {
 public:
  explicit Instances(std::vector<WallInstance> list);

  /// Where a rest position lies in an instance.
  struct Hit {
    const WallInstance* instance = nullptr;  // null: in none
    double rho = 0.0;                        // 0 at its middle, 1 on its outline
    Vec3 outward = Vec3::Zero();             // unit, from the middle, across `inward`
  };
  /// With c the centre, a the axis and q = p - c: rho = |q - a (a.q)| / (radius outline), where
  /// outline = 1 + irregularity noise(direction of q - a (a.q)), noise within half; inside while
  /// rho < 1 and |a.q| is at most radius + kReachMm. Moving p along a changes neither.
  Hit at(const Vec3& p_mm) const;
  /// How far the instance raises the wall at `p_mm` along its axis; 0 outside.
  static double raise_mm(const Hit& hit);

  const std::vector<WallInstance>& list() const { return list_; }
  static constexpr double kReachMm = 8.0;  // along the axis, beyond the radius: more than a fold

 private:
  std::vector<WallInstance> list_;
  Vec3 origin_ = Vec3::Zero();
  Vec3i size_ = Vec3i::Zero();
  std::vector<std::vector<std::uint8_t>> boxes_;  // indices into the list, of those that reach in
};

/// Changes what light meets where an instance is. `normal` is unit, of either side.
void paint_instance(const Instances::Hit& hit, const Vec3& p_mm, const Vec3f& normal,
                    MucosaSample& sample);

/// The text of truth/instances.csv: one line an instance.
std::string instances_csv(const std::vector<WallInstance>& list);

}  // namespace rugae
