#pragma once
// Frames on one plane become one picture: warping, gain compensation (Brown and Lowe), multi-band
// blending (Burt and Adelson).

#include <opencv2/core/mat.hpp>
#include <vector>

#include "core/types.h"

namespace rugae {

struct BlendInput {
  cv::Mat bgr;                               // CV_8UC3
  cv::Mat valid;                             // CV_8U, 255 where known
  Mat3 plane_from_image = Mat3::Identity();  // homography of pixels, (0.5, 0.5) convention
};

struct BlendResult {
  cv::Mat bgr;                    // CV_8UC3
  cv::Mat valid;                  // CV_8U
  cv::Mat seams;                  // CV_32S, the input each pixel came from, -1 outside
  Vec2 origin_px = Vec2::Zero();  // plane pixel = picture pixel + origin; whole numbers
  std::vector<double> gains;      // of the inputs
};

/// The first input is the anchor: where it is known it wins, except near its border; elsewhere a
/// pixel comes from the input that has it farthest from its border. `bounds` limits the canvas, in
/// plane pixels. Throws Error without inputs or when an input has the wrong type.
BlendResult blend(const std::vector<BlendInput>& inputs, const Eigen::AlignedBox2d& bounds,
                  int bands);

}  // namespace rugae
