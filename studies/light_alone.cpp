#include "studies/light_alone.h"

#include <algorithm>
#include <opencv2/core.hpp>

#include "render/light.h"
#include "validate/error_stats.h"

namespace rugae {

cv::Mat light_alone(const cv::Mat& depth_mm, const cv::Mat& normal, const Lens& lens,
                    const std::vector<Emitter>& lights) {
  std::vector<PlacedLight> placed;
  for (const Emitter& light : lights)
    placed.emplace_back(light, Mat3::Identity(), Vec3::Zero());  // camera axes
  const LensProjector projector(lens);
  cv::Mat out(depth_mm.size(), CV_32F, cv::Scalar(0));
  for (int y = 0; y < out.rows; ++y)
    for (int x = 0; x < out.cols; ++x) {
      const double z_mm = depth_mm.at<float>(y, x);
      const auto ray = projector.unproject({x + 0.5, y + 0.5});
      if (!ray || !(z_mm > 0.0)) continue;
      const cv::Vec3f n = normal.at<cv::Vec3f>(y, x);
      double sum = 0.0;
      for (const PlacedLight& light : placed) {
        const Arriving arriving = light.at(*ray * (z_mm / ray->z()));
        sum += arriving.irradiance * std::max(0.0, Vec3(n[0], n[1], n[2]).dot(arriving.to_light));
      }
      out.at<float>(y, x) = static_cast<float>(sum);
    }
  return out;
}

cv::Mat picture_of_light(const cv::Mat& light, const cv::Mat& through, const cv::Mat& gray,
                         const ToneCurve& tone) {
  constexpr unsigned char kDarkest = 8, kBrightest = 250;
  std::vector<double> stored, expected;
  for (int y = 0; y < gray.rows; ++y)
    for (int x = 0; x < gray.cols; ++x) {
      const unsigned char value = gray.at<unsigned char>(y, x);
      if (value < kDarkest || value > kBrightest) continue;
      stored.push_back(tone.linear(value / 255.0));
      expected.push_back(light.at<float>(y, x) * through.at<float>(y, x));
    }
  if (stored.empty()) return {};
  const double middle = median(std::move(expected));
  if (!(middle > 0.0)) return {};
  const double exposure = median(std::move(stored)) / middle;
  cv::Mat picture(light.size(), CV_8U);
  for (int y = 0; y < gray.rows; ++y)
    for (int x = 0; x < gray.cols; ++x)
      picture.at<unsigned char>(y, x) =
          cv::saturate_cast<unsigned char>(255.0 * tone.stored(exposure * light.at<float>(y, x)));
  return picture;
}

}  // namespace rugae
