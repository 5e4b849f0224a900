#pragma once
// Shape from shading by linear approximation: Tsai and Shah, Image and Vision Computing 12 (1994)
// 487-498, doi:10.1016/0262-8856(94)90002-7; slant, tilt and albedo are estimated from the image.
//
// Axes: x right, y down, Z the depth away from the viewer, all in px (the projection is taken as
// orthographic, the light as distant, the albedo as constant: the method's assumptions). With
// p = dZ/dx and q = dZ/dy the normal towards the viewer is (p, q, 1) in (right, down, towards), so
// the reflectance carries plus signs; for a height towards the viewer it would carry minus signs.

#include <opencv2/core/mat.hpp>

#include "core/types.h"
#include "recon/options.h"

namespace rugae {

/// A distant light: the unit vector to it is (cos(tilt) sin(slant), sin(tilt) sin(slant),
/// cos(slant)) in (right, down, towards the viewer).
struct LightEstimate {
  double slant_rad = 0.0;  // from the viewing axis, in [0, pi/2]
  double tilt_rad = 0.0;   // in the image plane from the x axis towards y (down), in (-pi, pi]
  double albedo = 1.0;     // of a surface that faces the light, in units of intensity
};

/// Moments of the intensity of a Lambertian surface of albedo 1 whose normals have a uniform tilt
/// and a slant b of density cos(b), under a light of the given slant, attached shadows included.
struct ShadingMoments {
  double mean = 0.0;  // E[I]
  double rms = 0.0;   // sqrt(E[I^2])
};
ShadingMoments shading_moments(double slant_rad);

/// Zheng and Chellappa, TPAMI 13 (1991) 680-702, doi:10.1109/34.85658. `intensity` is CV_32F,
/// `valid` CV_8U (empty: all); an image without light gives the default.
LightEstimate estimate_light(const cv::Mat& intensity, const cv::Mat& valid);

/// What a surface of albedo 1 and slopes p, q reflects of the light from `to_light` (unit), and its
/// derivative with respect to the depth Z of the pixel whose backward differences p and q are.
/// Where the surface faces away from the light the value is 0 and the derivative the one of the lit
/// side, which is what brings it back.
struct Reflectance {
  double value = 0.0, by_depth = 0.0;
};
Reflectance reflectance(double p, double q, const Vec3& to_light);

/// The relief Z (CV_32F, px, towards larger depth, zero where not valid) of an image (CV_32F).
cv::Mat tsai_shah(const cv::Mat& intensity, const cv::Mat& valid, const LightEstimate& light,
                  const ShadingOptions& options);

}  // namespace rugae
