#include "dataset/colours.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "core/check.h"
#include "core/units.h"
#include "dataset/layout.h"

namespace rugae {
namespace {

const cv::Vec3b kNothing(58, 54, 52);  // BGR, where there is no value

unsigned char byte(double value) {
  return static_cast<unsigned char>(std::lround(255.0 * std::clamp(value, 0.0, 1.0)));
}

// Hue by direction, white in the middle: an opponent-colour wheel (Baker et al., A database and
// evaluation methodology for optical flow, IJCV 2011, doi:10.1007/s11263-010-0390-2, figure 6).
cv::Vec3b flow_colour(double x, double y, double longest) {
  const double hue = (std::atan2(y, x) + kPi) / (2.0 * kPi) * 6.0;  // 0 to 6
  const double strength = std::min(std::hypot(x, y) / longest, 1.0);
  const auto channel = [&](double offset) {
    const double k = std::fmod(offset + hue, 6.0);
    const double full = 1.0 - std::max(0.0, std::min({k, 4.0 - k, 1.0}));
    return byte(1.0 - strength * (1.0 - full));
  };
  return {channel(1.0), channel(3.0), channel(5.0)};
}

struct Stop {
  double at;
  Vec3f srgb;
};
const std::array<Stop, 5> kErrorStops = {{{0.0, {0.11f, 0.49f, 0.49f}},
                                          {0.25, {0.56f, 0.77f, 0.66f}},
                                          {0.5, {0.97f, 0.91f, 0.73f}},
                                          {0.75, {0.91f, 0.45f, 0.32f}},
                                          {1.0, {0.49f, 0.07f, 0.16f}}}};

struct MaskColour {
  unsigned char bit;
  bool when_set;
  cv::Vec3b bgr;
  const char* css;
  const char* meaning;
};
const std::array<MaskColour, 4> kMaskColours = {
    {{kMaskFlowValid, false, {170, 120, 60}, "#3c78aa", "leaves the next frame"},
     {kMaskFlowOccluded, true, {190, 70, 190}, "#be46be", "hidden in the next frame"},
     {kMaskSpecular, true, {60, 200, 250}, "#fac83c", "reflection of the wet layer"},
     {kMaskSaturated, true, {50, 50, 240}, "#f03232", "saturated"}}};

}  // namespace

cv::Mat depth_picture(const cv::Mat& depth, double low, double high) {
  cv::Mat gray(depth.size(), CV_8U), colour;
  for (int y = 0; y < depth.rows; ++y)
    for (int x = 0; x < depth.cols; ++x) {
      const double d = depth.at<float>(y, x);
      gray.at<unsigned char>(y, x) =
          std::isfinite(d) ? byte(1.0 - (d - low) / std::max(high - low, 1e-9)) : 0;
    }
  cv::applyColorMap(gray, colour, cv::COLORMAP_INFERNO);
  for (int y = 0; y < depth.rows; ++y)
    for (int x = 0; x < depth.cols; ++x)
      if (!std::isfinite(depth.at<float>(y, x))) colour.at<cv::Vec3b>(y, x) = kNothing;
  return colour;
}

cv::Mat normal_picture(const cv::Mat& normal) {
  cv::Mat colour(normal.size(), CV_8UC3);
  for (int y = 0; y < normal.rows; ++y)
    for (int x = 0; x < normal.cols; ++x) {
      const cv::Vec3f n = normal.at<cv::Vec3f>(y, x);
      colour.at<cv::Vec3b>(y, x) =
          std::isfinite(n[0])
              ? cv::Vec3b(byte(0.5 - 0.5 * n[2]), byte(0.5 - 0.5 * n[1]), byte(0.5 + 0.5 * n[0]))
              : kNothing;
    }
  return colour;
}

cv::Mat flow_picture(const cv::Mat& flow_px, double longest_px) {
  cv::Mat colour(flow_px.size(), CV_8UC3);
  for (int y = 0; y < flow_px.rows; ++y)
    for (int x = 0; x < flow_px.cols; ++x) {
      const cv::Vec2f f = flow_px.at<cv::Vec2f>(y, x);
      const bool known = std::isfinite(f[0]) && std::isfinite(f[1]);
      colour.at<cv::Vec3b>(y, x) = known ? flow_colour(f[0], f[1], longest_px) : kNothing;
    }
  return colour;
}

cv::Mat flow_wheel(int side_px) {
  cv::Mat wheel(side_px, side_px, CV_8UC4, cv::Scalar(0, 0, 0, 0));
  const double r = 0.5 * side_px;
  for (int y = 0; y < side_px; ++y)
    for (int x = 0; x < side_px; ++x) {
      const double u = (x + 0.5 - r) / r, v = (y + 0.5 - r) / r;
      if (u * u + v * v > 1.0) continue;
      const cv::Vec3b c = flow_colour(u, v, 1.0);
      wheel.at<cv::Vec4b>(y, x) = {c[0], c[1], c[2], 255};
    }
  return wheel;
}

cv::Mat mask_picture(const cv::Mat& bgr, const cv::Mat& masks) {
  cv::Mat picture = bgr * 0.55;
  for (int y = 0; y < masks.rows; ++y)
    for (int x = 0; x < masks.cols; ++x) {
      const unsigned char bits = masks.at<unsigned char>(y, x);
      if (!(bits & kMaskValid)) {
        picture.at<cv::Vec3b>(y, x) = kNothing;
        continue;
      }
      for (const MaskColour& colour : kMaskColours)
        if (((bits & colour.bit) != 0) == colour.when_set) picture.at<cv::Vec3b>(y, x) = colour.bgr;
    }
  return picture;
}

// Hues a golden angle apart: successive numbers look least alike.
cv::Mat number_picture(const cv::Mat& numbers) {
  cv::Mat picture(numbers.size(), CV_8UC3, cv::Scalar(kNothing[0], kNothing[1], kNothing[2]));
  const int channels = numbers.channels();
  for (int y = 0; y < numbers.rows; ++y)
    for (int x = 0; x < numbers.cols; ++x) {
      const float number = numbers.depth() == CV_8U ? numbers.ptr<unsigned char>(y)[x * channels]
                                                    : numbers.ptr<float>(y)[x * channels];
      if (!(number > 0.0f)) continue;
      constexpr double kGoldenTurn = 0.6180339887498949;
      const double angle = 2.0 * kPi * std::fmod(kGoldenTurn * number, 1.0);
      picture.at<cv::Vec3b>(y, x) = flow_colour(std::cos(angle), std::sin(angle), 1.2);
    }
  return picture;
}

std::string mask_key_html() {
  std::string out;
  for (const MaskColour& colour : kMaskColours)
    out += fmt::format("<span class=\"key\"><i style=\"background:{}\"></i>{}</span> ", colour.css,
                       colour.meaning);
  return out;
}

Vec3f error_colour(double t) {
  if (!(t > 0.0)) return kErrorStops.front().srgb;
  for (std::size_t i = 1; i < kErrorStops.size(); ++i) {
    const Stop &a = kErrorStops[i - 1], &b = kErrorStops[i];
    if (t <= b.at)
      return a.srgb + static_cast<float>((t - a.at) / (b.at - a.at)) * (b.srgb - a.srgb);
  }
  return kErrorStops.back().srgb;
}

std::string error_gradient_css() {
  std::string css = "linear-gradient(to right";
  for (const Stop& stop : kErrorStops)
    css += fmt::format(",rgb({},{},{}) {:g}%", byte(stop.srgb[0]), byte(stop.srgb[1]),
                       byte(stop.srgb[2]), 100.0 * stop.at);
  return css + ")";
}

std::string depth_gradient_css() {
  cv::Mat gray(1, 9, CV_8U), colour;
  for (int i = 0; i < 9; ++i) gray.at<unsigned char>(0, i) = byte(1.0 - i / 8.0);
  cv::applyColorMap(gray, colour, cv::COLORMAP_INFERNO);
  std::string css = "linear-gradient(to right";
  for (int i = 0; i < 9; ++i) {
    const cv::Vec3b c = colour.at<cv::Vec3b>(0, i);
    css += fmt::format(",rgb({},{},{})", c[2], c[1], c[0]);
  }
  return css + ")";
}

double quantile(const cv::Mat& image, double share) {
  std::vector<float> values;
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x)
      if (std::isfinite(image.at<float>(y, x))) values.push_back(image.at<float>(y, x));
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto at = static_cast<std::ptrdiff_t>(share * (values.size() - 1.0));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

}  // namespace rugae
