#pragma once
// How far a calibrated lens is from the true one, and lenses that are wrong on purpose.

#include "cameras/camera.h"

namespace rugae {

/// Distances are those between the pixels at which the two lenses see the same ray, over a grid of
/// the true lens' picture. Nothing is aligned: a principal point that is off by a pixel counts as
/// one, though a camera turned by as much sees almost the same.
struct LensDifference {
  double focal_share = 0.0;           // mean of fx and fy over the true ones, less 1
  double principal_point_px = 0.0;    // distance
  double projection_rms_px = 0.0;     // over the picture within the field stop
  double projection_corner_px = 0.0;  // RMS of its four corners, or of the field stop's outline
                                      // towards them
};

/// Throws Error when sizes differ or the found lens does not see some of what the true one does.
LensDifference compare(const Lens& found, const Lens& truth);

/// A lens calibrated wrongly by `share`, such as 0.01: both focal lengths and every distortion
/// coefficient are 1 + share of the true ones. The principal point, the size and the field stop
/// stay. A larger focal length with a distortion that is larger too is what calibrations from
/// boards that tilt little are wrong by: the two make up for each other in the middle of the
/// picture and part at its borders. Throws Error when nothing is left that projects the whole
/// picture (a share far below 0).
Lens perturbed(const Lens& lens, double share);

}  // namespace rugae
