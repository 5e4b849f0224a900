#include "recon/pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/spread.h"
#include "core/units.h"
#include "dataset/colours.h"
#include "recon/flow.h"
#include "recon/keyframes.h"
#include "recon/preprocess/reflections.h"

namespace rugae {
namespace {

constexpr int kSubpixelBits = 4;  // of OpenCV's drawing: sixteenths of a pixel

// A pixel position in OpenCV's integer-centre convention, fixed point.
cv::Point drawn_at(const Vec2& px) {
  constexpr double kUnit = 1 << kSubpixelBits;
  return {static_cast<int>(std::lround((px.x() - 0.5) * kUnit)),
          static_cast<int>(std::lround((px.y() - 0.5) * kUnit))};
}

cv::Mat hue_to_bgr(const cv::Mat& hsv) {
  cv::Mat bgr;
  cv::cvtColor(hsv, bgr, cv::COLOR_HSV2BGR);
  return bgr;
}

// Hue of a quantity in [0, 1] from blue (0) to red (1).
cv::Scalar ramp(double share) {
  const cv::Mat hsv(1, 1, CV_8UC3,
                    cv::Scalar(120.0 * (1.0 - std::clamp(share, 0.0, 1.0)), 220.0, 255.0));
  const auto c = hue_to_bgr(hsv).at<cv::Vec3b>(0, 0);
  return {static_cast<double>(c[0]), static_cast<double>(c[1]), static_cast<double>(c[2])};
}

// Between the 2nd and the 98th percentile, so that one far corner does not take all colours.
cv::Mat relief_picture(const cv::Mat& depth) {
  const double low = quantile(depth, 0.02), high = quantile(depth, 0.98);
  return depth_picture(depth, low, high);
}

std::string name_of(int frame) { return fmt::format("{:06}.png", frame); }

cv::Mat gray_as_bgr(const cv::Mat& gray) {
  cv::Mat bgr;
  cv::cvtColor(gray, bgr, cv::COLOR_GRAY2BGR);
  return bgr;
}

cv::Mat with_points(const cv::Mat& gray, const std::vector<FollowedPoint>& points) {
  constexpr double kLongTrack = 12.0;  // key frames: drawn red
  cv::Mat drawn = gray_as_bgr(gray);
  for (const FollowedPoint& point : points)
    cv::circle(drawn, drawn_at(point.pixel), 2 << kSubpixelBits,
               ramp(static_cast<double>(point.keyframes) / kLongTrack), -1, cv::LINE_AA,
               kSubpixelBits);
  return drawn;
}

}  // namespace

void draw_preprocess(const PictureSink& sink, const FrameSource& frames,
                     const std::vector<int>& indices, const PreprocessOptions& options) {
  for (const int index : indices) {
    const cv::Mat bgr = frames.observations().image(index);
    cv::Mat gray;
    cv::cvtColor(bgr, gray, cv::COLOR_BGR2GRAY);
    const cv::Mat reflection = detect_reflections(gray, options.reflections, frames.field());
    const Frame frame = frames.frame(index);
    sink("original/" + name_of(index), bgr);
    sink("mask/" + name_of(index), reflection);
    sink("inpainted/" + name_of(index), suppress_reflections(bgr, reflection, options.reflections));
    sink("preprocessed/" + name_of(index), frame.map_bgr);
    sink("pose/" + name_of(index), frame.gray);
  }
}

void draw_pairs(const PictureSink& sink, const FrameSource& frames,
                const std::vector<PairAlignment>& pairs) {
  for (const PairAlignment& pair : pairs) {
    if (pair.reference_px.empty()) continue;
    const std::string name = fmt::format("{:06}-{:06}.png", pair.reference, pair.moving);
    const cv::Mat reference = frames.gray(pair.reference);
    const cv::Mat flow = farneback_flow(reference, frames.gray(pair.moving), {}, frames.valid());
    std::vector<double> lengths;
    for (std::size_t i = 0; i < pair.reference_px.size(); ++i)
      lengths.push_back((pair.moving_px[i] - pair.reference_px[i]).norm());
    double max_px = 1.0;
    for (const double length : lengths) max_px = std::max(max_px, length);
    sink("flow/" + name, flow_picture(flow, max_px));
    cv::Mat drawn = gray_as_bgr(reference);
    for (std::size_t i = 0; i < lengths.size(); ++i) {
      cv::line(drawn, drawn_at(pair.reference_px[i]), drawn_at(pair.moving_px[i]),
               ramp(lengths[i] / max_px), 1, cv::LINE_AA, kSubpixelBits);
      cv::circle(drawn, drawn_at(pair.reference_px[i]), 1 << kSubpixelBits, {255, 255, 255}, -1,
                 cv::LINE_AA, kSubpixelBits);
    }
    sink("inliers/" + name, drawn);
  }
}

void draw_followed(const PictureSink& sink, const cv::Mat& gray, int frame,
                   const std::vector<FollowedPoint>& points) {
  sink("followed/" + name_of(frame), with_points(gray, points));
}

void draw_tracks(const PictureSink& sink, const FrameSource& frames, const Structure& structure,
                 const std::vector<int>& keyframes) {
  for (const int k : keyframes) {
    std::vector<FollowedPoint> points;
    for (const Track& track : structure.tracks)
      for (const auto& o : track.observations)
        if (o.keyframe == k) points.push_back({o.pixel, track.observations.size()});
    const int frame = structure.frames[k];
    sink("tracks/" + name_of(frame), with_points(frames.gray(frame), points));
  }
}

void draw_links(const PictureSink& sink, const Structure& structure) {
  constexpr int kMostPx = 1000;  // of the picture: of more key frames each pixel is several
  constexpr double kMany = 500;  // shared points: the brightest
  const auto n = static_cast<int>(structure.frames.size());
  if (n == 0) return;
  const int each = (n + kMostPx - 1) / kMostPx, side = (n + each - 1) / each;
  cv::Mat shared(side, side, CV_32F, cv::Scalar(0.0));
  for (const Track& track : structure.tracks)
    for (const auto& a : track.observations)
      for (const auto& b : track.observations)
        if (a.keyframe != b.keyframe)
          shared.at<float>(a.keyframe / each, b.keyframe / each) += 1.0f / static_cast<float>(each);
  cv::Mat brightness, gray, drawn;
  cv::log(shared + 1.0f, brightness);
  brightness.convertTo(gray, CV_8U, 255.0 / std::log1p(kMany));
  cv::applyColorMap(gray, drawn, cv::COLORMAP_INFERNO);
  const int enlarged = std::max(1, kMostPx / side);
  cv::resize(drawn, drawn, {}, enlarged, enlarged, cv::INTER_NEAREST);
  sink("links/keyframes.png", drawn);
}

void draw_depth_maps(const PictureSink& sink, const std::vector<DepthExample>& examples,
                     double max_sigma_share) {
  for (const DepthExample& example : examples) {
    const std::string name = name_of(example.frame);
    const double low = quantile(example.found, 0.02), high = quantile(example.found, 0.98);
    sink("wide/" + name, example.picture);
    sink("stereo/" + name, depth_picture(example.found, low, high));
    sink("agreed/" + name, depth_picture(example.agreed, low, high));
    sink("sigma/" + name,
         depth_picture(cv::Mat(example.sigma / example.agreed), 0.0, max_sigma_share));
  }
}

void draw_mosaics(const PictureSink& sink, const std::vector<MosaicExample>& examples) {
  for (const MosaicExample& example : examples) {
    const Mosaic& mosaic = example.mosaic;
    const std::string name = fmt::format("{:03}.png", example.number);
    sink("mosaic/" + name, mosaic.bgr);
    cv::Mat drawn = mosaic.bgr.clone();
    for (int y = 1; y < drawn.rows; ++y)
      for (int x = 1; x < drawn.cols; ++x)
        if (mosaic.seams.at<int>(y, x) != mosaic.seams.at<int>(y, x - 1) ||
            mosaic.seams.at<int>(y, x) != mosaic.seams.at<int>(y - 1, x))
          drawn.at<cv::Vec3b>(y, x) = {0, 255, 255};
    sink("seams/" + name, drawn);
    if (example.depth) sink("depth/" + name, relief_picture(example.depth->depth));
  }
}

}  // namespace rugae
