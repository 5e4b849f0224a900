#pragma once
// Points of the wall followed over a sequence, and how often each triangle was seen.

#include <filesystem>
#include <string>
#include <vector>

#include "core/types.h"

namespace rugae {

/// A material point of the wall.
struct TrackPoint {
  int point = 0;  // its number
  int triangle = 0;
  float b1 = 0.0f, b2 = 0.0f;      // barycentric coordinates of the second and third corner
  bool seen_along_normal = false;  // by a camera that looks along the triangle's winding normal
};

/// Where a point lands in a frame's image.
struct TrackSample {
  int point = 0;
  Vec2 pixel = Vec2::Zero();
  double depth_mm = 0.0;  // along z, at the time of the row it lands in
  bool visible = false;   // neither turned away nor behind other wall
};

/// "point,triangle,b1,b2" and "point,x,y,depth_mm,visible", a line each.
std::string track_points_text(const std::vector<TrackPoint>& points);
std::string tracks_text(const std::vector<TrackSample>& samples);
/// Throw Error with file and line. `seen_along_normal` of a point is not on disk.
std::vector<TrackPoint> read_track_points(const std::filesystem::path& file);
std::vector<TrackSample> read_tracks(const std::filesystem::path& file);

/// "triangle,frames" for every triangle that some pixel of some frame sees: in how many frames it
/// is. `files` are truth/triangles/*.exr.
std::string coverage_text(const std::vector<std::filesystem::path>& files);

}  // namespace rugae
