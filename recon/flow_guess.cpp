#include "recon/flow_guess.h"

#include <opencv2/imgproc.hpp>

namespace rugae {

cv::Mat guess_flow(const std::vector<Vec2>& from, const std::vector<Vec2>& to, double scale,
                   cv::Size size) {
  if (from.size() < static_cast<std::size_t>(kMinGuessPoints)) return {};
  constexpr int kNodes = 20;  // across
  const double step = static_cast<double>(size.width) / kNodes;
  const double softness_px = size.width / 12.0;
  cv::Mat nodes(std::max(2, static_cast<int>(size.height / step)), kNodes, CV_32FC2);
  for (int v = 0; v < nodes.rows; ++v) {
    for (int u = 0; u < nodes.cols; ++u) {
      const Vec2 at((u + 0.5) * size.width / nodes.cols, (v + 0.5) * size.height / nodes.rows);
      double weights = 0.0;
      Vec2 sum = Vec2::Zero();
      for (std::size_t i = 0; i < from.size(); ++i) {
        const double d2 = (from[i] - at).squaredNorm() + softness_px * softness_px;
        const double weight = 1.0 / (d2 * d2);
        weights += weight;
        sum += weight * (to[i] - from[i]);
      }
      sum *= scale / weights;
      nodes.at<cv::Vec2f>(v, u) = {static_cast<float>(sum.x()), static_cast<float>(sum.y())};
    }
  }
  cv::Mat flow;
  cv::resize(nodes, flow, size, 0, 0, cv::INTER_LINEAR);
  return flow;
}

cv::Mat continued(const PairAlignment& pair, int next, cv::Size size) {
  const double scale = static_cast<double>(next - pair.moving) / (pair.moving - pair.reference);
  std::vector<Vec2> to(pair.moving_px.size());
  for (std::size_t i = 0; i < to.size(); ++i)
    to[i] = pair.moving_px[i] + (pair.moving_px[i] - pair.reference_px[i]);
  return guess_flow(pair.moving_px, to, scale, size);
}

cv::Mat continued_from(const PairAlignment& pair, int next, cv::Size size) {
  const double scale = static_cast<double>(next - pair.reference) / (pair.moving - pair.reference);
  return guess_flow(pair.reference_px, pair.moving_px, scale, size);
}

}  // namespace rugae
