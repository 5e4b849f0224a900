#pragma once
// Correspondences to a fraction of a pixel: each point's own small patch, matched up to gain and
// offset.

#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "core/types.h"

namespace rugae {

struct PointRefinementOptions {
  double radius_px = 7.0;
  int max_iterations = 12;
  double max_motion_px = 4.0;      // further from the start: another minimum
  double min_correlation = 0.7;    // normalised cross-correlation of the patches at the end
  double max_deviation_px = 0.25;  // predicted standard deviation of the worse direction
};

/// What is looked for, a disc of a picture: made once, found in many.
struct PointTemplate {
  /// Eight values, their eight derivatives by x and by y, and so on over the disc, filled up with
  /// zeros; means removed, and from the derivatives what is along the values.
  std::vector<float> eights;
  double norm = 0.0;                    // of the values
  Mat2 inverse_hessian = Mat2::Zero();  // of the squared difference over the place
  double weakest = 0.0;                 // eigenvalue of the Hessian
};

/// Gauss-Newton on the place in another picture of the patch around a point; `linear` is the
/// patch's linear map, mov from ref, kept. The squared difference is normalised: mean and gain of
/// each patch are removed (the light moves with the camera), as in Lucas and Kanade with affine
/// illumination (Baker and Matthews, IJCV 2004, doi:10.1023/B:VISI.0000011205.11775.fd, inverse
/// compositional). Made once for many points: the disc is theirs in common. Calls are thread-safe.
class PointRefiner {
 public:
  explicit PointRefiner(const PointRefinementOptions& options);

  /// Of a CV_32F picture. Empty when the patch leaves it or has no texture.
  std::optional<PointTemplate> make_template(const cv::Mat& reference,
                                             const Vec2& reference_px) const;
  /// In a CV_32F picture, started at `start_px`; the template is of a refiner with this radius, or
  /// Error is thrown. Empty when the patch leaves it, does not converge,
  /// matches badly, or its texture does not fix the place.
  std::optional<Vec2> operator()(const PointTemplate& sought, const cv::Mat& moving,
                                 const Vec2& start_px, const Mat2& linear) const;

 private:
  struct Comparison;
  std::optional<Comparison> compare(const PointTemplate& sought, const cv::Mat& image,
                                    const Vec2& place, const Mat2& linear) const;

  PointRefinementOptions options_;
  int radius_ = 0;              // whole px
  std::size_t count_ = 0;       // pixels of the disc
  std::vector<float> dx_, dy_;  // of each pixel from the centre; filled up with zeros to eights
  std::vector<int> at_;         // its place in the square of side 2 radius + 3 around the disc
  std::vector<int> pixel_;      // all bits set for a pixel, none for what fills up
};

/// One point alone.
std::optional<Vec2> refine_point(const cv::Mat& reference, const cv::Mat& moving,
                                 const Vec2& reference_px, const Vec2& moving_px,
                                 const Mat2& linear, const PointRefinementOptions& options);

}  // namespace rugae
