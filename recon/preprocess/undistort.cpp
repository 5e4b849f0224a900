#include "recon/preprocess/undistort.h"

#include <tbb/parallel_for.h>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace rugae {
namespace {

constexpr float kNowherePx = -1e4F;   // far outside every image
constexpr double kRoundingPx = 1e-6;  // a lens' inverse comes back to within this

// Where cubic interpolation takes no pixel that the field stop made black: two to each side.
bool within_stop(const Lens& lens, const Vec2& pixel) {
  constexpr double kReachPx = 2.0;
  for (const double dx : {-kReachPx, kReachPx})
    for (const double dy : {-kReachPx, kReachPx})
      if (!lens.passes_stop(pixel + Vec2(dx, dy))) return false;
  return true;
}

}  // namespace

Undistortion::Undistortion(const Lens& from, const Lens& to)
    : valid_(to.height, to.width, CV_8U, cv::Scalar(0)) {
  cv::Mat source_px(to.height, to.width, CV_32FC2);
  const LensProjector straight(to), seen(from);
  tbb::parallel_for(0, to.height, [&](int y) {
    auto* row = source_px.ptr<cv::Vec2f>(y);
    for (int x = 0; x < to.width; ++x) {
      row[x] = {kNowherePx, kNowherePx};
      const std::optional<Vec3> ray = straight.unproject({x + 0.5, y + 0.5});
      if (!ray) continue;
      const std::optional<Vec2> pixel = seen.project(*ray);
      if (!pixel) continue;
      row[x] = {static_cast<float>(pixel->x() - 0.5), static_cast<float>(pixel->y() - 0.5)};
      const double low = 0.5 - kRoundingPx, right = from.width - low, bottom = from.height - low;
      const bool inside =
          pixel->x() >= low && pixel->x() <= right && pixel->y() >= low && pixel->y() <= bottom;
      if (inside && within_stop(from, *pixel)) valid_.at<unsigned char>(y, x) = 255;
    }
  });
  cv::convertMaps(source_px, {}, source_px_, source_step_, CV_16SC2);
}

cv::Mat Undistortion::image(const cv::Mat& image) const {
  cv::Mat moved;
  cv::remap(image, moved, source_px_, source_step_, cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  moved.setTo(0, valid_ == 0);
  return moved;
}

cv::Mat Undistortion::mask(const cv::Mat& mask) const {
  cv::Mat moved;
  cv::remap(mask, moved, source_px_, source_step_, cv::INTER_LINEAR, cv::BORDER_CONSTANT,
            cv::Scalar(0));
  return moved >= 128;
}

}  // namespace rugae
