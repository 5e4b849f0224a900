#include "dataset/image_overlap.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace rugae {
namespace {

constexpr int kWidth = 160;  // px, of the images that are compared
constexpr int kPatch = 21;   // px
constexpr int kReach = kWidth / 4;
constexpr double kFound = 0.7;     // correlation; of unrelated texture at most about 0.5
constexpr double kContrast = 2.0;  // least standard deviation of a textured patch, of 255
constexpr double kBlack = 3.0;     // of 255; the edge of a field stop is always found again
constexpr int kFew = 8;

cv::Mat small(const cv::Mat& gray) {
  cv::Mat image;
  const double scale = static_cast<double>(kWidth) / gray.cols;
  cv::resize(gray, image, cv::Size(), scale, scale, cv::INTER_AREA);
  return image;
}

cv::Mat texture_of(const cv::Mat& gray) {
  cv::Mat image, slow;
  gray.convertTo(image, CV_32F);
  cv::GaussianBlur(image, slow, cv::Size(), 6.0);
  cv::GaussianBlur(image, image, cv::Size(), 0.8);
  return image - slow;
}

}  // namespace

double found_again(const cv::Mat& image, const cv::Mat& other) {
  const cv::Mat light = small(image), from = texture_of(light), to = texture_of(small(other));
  int textured = 0, found = 0;
  for (int y = 0; y + kPatch <= from.rows; y += kPatch)
    for (int x = 0; x + kPatch <= from.cols; x += kPatch) {
      const cv::Rect at(x, y, kPatch, kPatch);
      const cv::Mat patch = from(at);
      cv::Scalar mean, deviation;
      cv::meanStdDev(patch, mean, deviation);
      double darkest = 0.0;
      cv::minMaxLoc(light(at), &darkest);
      if (!(deviation[0] >= kContrast) || darkest <= kBlack) continue;
      ++textured;
      const cv::Rect around =
          cv::Rect(x - kReach, y - kReach, kPatch + 2 * kReach, kPatch + 2 * kReach) &
          cv::Rect(0, 0, to.cols, to.rows);
      cv::Mat correlation;
      cv::matchTemplate(to(around), patch, correlation, cv::TM_CCOEFF_NORMED);
      double best = 0.0;
      cv::minMaxLoc(correlation, nullptr, &best);
      found += best >= kFound ? 1 : 0;
    }
  return textured < kFew ? -1.0 : static_cast<double>(found) / textured;
}

}  // namespace rugae
