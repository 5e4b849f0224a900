#pragma once
// Worlds with known answers: points on a bumpy closed cavity, seen by a camera that moves inside
// it; and plain pictures of that cavity. Nothing here comes from the renderer.

#include <cstdint>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "cameras/camera.h"
#include "cameras/row_poses.h"
#include "core/rigid3.h"
#include "recon/structure.h"

namespace rugae::synthetic {

struct Options {
  int cameras = 12;
  double step_rad = 0.1;       // of the path's angle between cameras: 5 mm at the default size
  int turn_at = 0;             // this camera goes back, between the places of those before; 0: none
  int width = 640;             // px, 4 : 3
  int points = 3000;           // on the whole wall
  int first_camera = 0;        // that sees anything
  int max_run = 12;            // cameras a track lives for at most
  double readout_share = 0.0;  // of the time from a camera to the next; 0: all rows at once
  double noise_px = 0.0;       // standard deviation of each coordinate of an observation
  double outlier_share = 0.0;  // of observations moved by up to 40 px in each coordinate
  double unit = 1.0;           // length of the world's unit: 1000 gives the world in micrometres
  Rigid3 moved = {};           // applied to the whole world, in its unit
  std::uint64_t seed = 1;
};

struct World {
  Lens lens;                           // pinhole, 640 x 480, 100 degrees across
  std::vector<Rigid3> cam_from_world;  // the truth
  std::vector<Vec3> points;            // the truth, of each track
  std::vector<Track> tracks;           // observations with rays; no points yet
  std::vector<int> frames;             // 0, 1, 2, ...
};

/// Distance of the wall from the cavity's centre in a unit direction: about 40 mm, folds of 3 mm.
double wall_radius_mm(const Vec3& direction);
/// World from camera at an angle along the path, mm: inside the cavity, looking at the wall.
Rigid3 world_from_camera(double angle_rad);
/// The path's angle of a camera.
double angle_of(const Options& options, int camera);
/// World from camera of all rows while a camera of a path without turn is read, mm; frames are 1 /
/// 30 s apart.
RowPoses rows_of(const Options& options, int camera);
Lens lens_of(int width, int height);
World make_world(const Options& options);

/// What the camera sees: mottled wall under a light at the camera, 8-bit BGR. The noise is white
/// with that standard deviation in grey levels.
cv::Mat picture(const Lens& lens, const RowPoses& world_from_camera, double noise_levels,
                std::uint64_t seed, int frame);
inline cv::Mat picture(const Lens& lens, const Rigid3& world_from_camera, double noise_levels,
                       std::uint64_t seed, int frame) {
  return picture(lens, RowPoses(world_from_camera), noise_levels, seed, frame);
}

/// A folder of numbered pictures with a calibration file next to it, as a user would have it.
struct Recording {
  std::filesystem::path images, calibration;
  std::vector<Rigid3> world_from_camera;
};
Recording record(const std::filesystem::path& folder, const Lens& lens,
                 const std::vector<Rigid3>& world_from_camera, double noise_levels = 0.0);
/// The same through a rolling shutter.
Recording record(const std::filesystem::path& folder, const Lens& lens,
                 const std::vector<RowPoses>& world_from_camera, double noise_levels);

/// Without every second key frame but the last, and what they alone saw.
Structure every_other_keyframe(Structure half);

/// Root mean square distance of estimated camera centres to the true ones after the best Sim(3),
/// and the largest error of the turn from the first camera to another (a short path fixes the whole
/// rotation badly); over placed cameras only.
struct PathError {
  double rmse = 0.0, worst_rotation_rad = 0.0,
         path_extent = 0.0;  // rmse and extent in the truth's unit
  int cameras = 0;
};
PathError path_error(const std::vector<Rigid3>& estimated_world_from_camera,
                     const std::vector<Rigid3>& true_world_from_camera);
PathError path_error(const Structure& structure, const World& world);

}  // namespace rugae::synthetic
