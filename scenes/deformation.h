#pragma once
// How the stomach moves: peristalsis and breathing, as a smooth function of rest position and time.

#include <string>

#include "core/field.h"
#include "core/yaml.h"
#include "scenes/organ_axis.h"
#include "scenes/scene.h"

namespace rugae {

struct DeformationOptions {
  bool peristalsis = false;
  double waves_per_minute = 3.0;
  double speed_mm_s = 2.2;    // of a wave's crest along the axis
  double amplitude_mm = 7.0;  // of the indentation, towards the axis
  double occlusion = 0.58;  // at most this share of the lumen's radius: reached before the pylorus
  double width_mm = 16.0;   // of a contraction, along the axis, at half its depth
  bool breathing = false;
  double breaths_per_minute = 15.0;
  double sway_mm = 4.0;  // of the fundus, from full expiration to full inspiration
  /// Throws Error naming `where` and the field that is out of range.
  void check(const std::string& where) const;
};

/// Keeps what the mapping does not name. Throws Error with file, line and column.
void read_deformation(YamlReader yaml, DeformationOptions& options);

/// Every option's key and range.
std::vector<Field> list_deformation();

/// Every option, as a mapping in one line.
std::string deformation_yaml(const DeformationOptions& options);

/// How strong the contractions are along the organ: 0 before the first length, rising to 1 at the
/// second, and back to 0 between the last two. Arc lengths of the axis, mm.
struct PeristalsisZone {
  double rise_from_mm = 0.0, rise_to_mm = 0.0;
  double fall_from_mm = 0.0, fall_to_mm = 0.0;
};

/// Depth of a contraction over its greatest, `offset_mm` along the axis from its crest: a bump of
/// compact support with two continuous derivatives, half as high at +-width_mm / 2.
double contraction_profile(double offset_mm, double width_mm);

/// How far a crest moves the wall towards the axis where the wall is `off_axis_mm` away from it and
/// the zone's strength is `strength` (0 to 1): the amplitude, but no more than the occlusion's
/// share of the way.
double contraction_depth_mm(const DeformationOptions& options, double off_axis_mm, double strength);

struct OrganMotion {
  WallMotion motion;      // empty where neither peristalsis nor breathing is on
  double reach_mm = 0.0;  // no vertex is ever farther from its rest position
};

/// The motion of the given rest positions along their organ's axis. A wave's crest is at
/// `zone.rise_from_mm` at time 0, and so every 60 / waves_per_minute seconds; breathing is at full
/// inspiration then, its sway half a `sway_mm` to either side of rest.
OrganMotion make_motion(const DeformationOptions& options, const PeristalsisZone& zone,
                        const OrganAxis& axis, const std::vector<Vec3>& rest_positions_mm);

}  // namespace rugae
