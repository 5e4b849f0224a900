#pragma once
// A stop-motion around a flat target: the views that a lens is calibrated from.

#include <cstdint>
#include <string>

#include "cameras/camera.h"
#include "core/pose_track.h"

namespace rugae {

/// How the views are drawn. Each differs from the others in distance, in the direction and the
/// amount of its tilt, in its turn around the line of sight, and in the part of the picture that it
/// covers (Zhang 2000, doi:10.1109/34.888718: tilts of about 45 degrees determine the focal length
/// best; distortion shows at the picture's borders and corners). Of eight views four reach into the
/// corners of the picture, two to anywhere on its borders, and two are around its middle.
struct BoardViewOptions {
  int count = 0;                 // 0: the trajectory is none around a board
  double least_fill = 0.35;      // share of the picture's width or height that the board takes up,
  double most_fill = 0.9;        // whichever is more, where it stands upright in the middle
  double most_tilt_rad = 0.785;  // from facing the camera
  double margin_share = 0.01;    // of the picture's width, kept free around the board
  double most_incidence_rad = 1.2;  // of the line of sight anywhere on the board
};

/// A flat rectangle in the world, seen from the side from which `across`, `down` and the line of
/// sight are right-handed, as x, y and z of a camera are.
struct BoardOutline {
  Vec3 first_mm = Vec3::Zero();  // the corner to the upper left
  Vec3 across_mm, down_mm;       // its sides, perpendicular
};

/// Whether the lens sees the whole board: every point of a lattice over it lies in front, at least
/// `margin_px` within picture and field stop, at least `clearance_mm` from the camera's centre, and
/// is met by a line of sight of at most the options' incidence.
bool sees_board(const LensProjector& lens, const BoardOutline& board, const Rigid3& cam_from_world,
                double margin_px, double clearance_mm, double most_incidence_rad);

/// `frames` poses at index / fps, in each of which the lens sees the whole board. The same lens,
/// board, options and seed give the same poses; a view does not depend on how many there are.
/// Throws Error naming `name`, the view and the board's size when the board cannot be seen wholly.
PoseTrack plan_board_views(const Lens& lens, const BoardOutline& board,
                           const BoardViewOptions& options, double clearance_mm, int frames,
                           double fps, std::uint64_t seed, const std::string& name);

/// The pose of a stop-motion at a time counted in frames: that of the nearest frame.
Rigid3 held_pose(const PoseTrack& track, double frame);

}  // namespace rugae
