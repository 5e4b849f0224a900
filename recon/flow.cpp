#include "recon/flow.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "core/check.h"
#include "recon/block_search.h"
#include "recon/small_blur.h"

namespace rugae {
namespace {

constexpr double kLightShare = 1.0 / 45.0;  // blur of the light over the width
constexpr int kCoarseWidthPx = 80;
constexpr int kCellPx = 10;   // at the coarse width; blocks are two cells wide and overlap by half
constexpr int kReachPx = 20;  // at the coarse width
constexpr int kSupportRounds = 2;
constexpr int kSupportPx = 2;  // neighbouring blocks may differ by this in their motion
constexpr float kSupportWeight = 0.5F;

// The scores of a block for every motion up to the reach.
using Scores = std::vector<cv::Mat>;

// A block's score gains by the best of its neighbours' scores at nearly the same motion: a block
// without texture moves with those around it.
Scores supported(const Scores& scores, int columns, int rows) {
  Scores widened, result;
  const int side = 2 * kSupportPx + 1;
  for (const cv::Mat& s : scores) {
    widened.emplace_back();
    cv::dilate(s, widened.back(), cv::Mat::ones(side, side, CV_8U));
  }
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      cv::Mat sum = scores[static_cast<std::size_t>(y * columns + x)].clone();
      for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
        const int u = x + dx, v = y + dy;
        if (u < 0 || v < 0 || u >= columns || v >= rows) continue;
        sum += kSupportWeight * widened[static_cast<std::size_t>(v * columns + u)];
      }
      result.push_back(sum / 3.0);
    }
  }
  return result;
}

}  // namespace

cv::Mat even_light(const cv::Mat& gray, const cv::Mat& valid) {
  constexpr double kContrast = 40.0, kMiddle = 128.0;  // of the 8-bit result
  constexpr double kFloor = 1.0;  // grey levels: below, noise would be blown up
  const double sigma = std::max(2.0, kLightShare * gray.cols);
  const bool everywhere = valid.empty() || cv::countNonZero(valid == 0) == 0;
  cv::Mat share;  // of a pixel's surroundings that is valid
  if (!everywhere) {
    cv::Mat(valid != 0).convertTo(share, CV_32F, 1.0 / 255.0);
    share = cv::max(small_blur(share, sigma, cv::BORDER_REFLECT), 1e-3);
  }
  // Both as small as the blur leaves them.
  const auto mean_of = [&](const cv::Mat& values) {
    const cv::Mat mean = small_blur(values, sigma, cv::BORDER_REFLECT);
    return everywhere ? mean : cv::Mat(mean / share);
  };
  const auto enlarged = [&](const cv::Mat& small) {
    cv::Mat large;
    cv::resize(small, large, gray.size(), 0, 0, cv::INTER_LINEAR);
    return large;
  };
  cv::Mat value, deviation, even, result;
  gray.convertTo(value, CV_32F);
  if (!everywhere) value.setTo(0.0, valid == 0);
  value -= enlarged(mean_of(value));
  if (!everywhere) value.setTo(0.0, valid == 0);
  cv::sqrt(mean_of(value.mul(value)), deviation);
  cv::divide(value, enlarged(deviation + kFloor), even);
  even.convertTo(result, CV_8U, kContrast, kMiddle);
  return result;
}

FlowImage prepare_flow(const cv::Mat& gray, const cv::Mat& valid) {
  check(gray.type() == CV_8U, "optical flow: expected an 8-bit gray image, found type {}",
        gray.type());
  check(valid.empty() || (valid.type() == CV_8U && valid.size() == gray.size()),
        "optical flow: expected a mask of {} x {}, found {} x {}", gray.cols, gray.rows, valid.cols,
        valid.rows);
  const double shrink = std::max(1.0, gray.cols / static_cast<double>(kCoarseWidthPx));
  const cv::Size size(static_cast<int>(std::lround(gray.cols / shrink)),
                      static_cast<int>(std::lround(gray.rows / shrink)));
  cv::Mat small, small_valid;
  cv::resize(gray, small, size, 0, 0, cv::INTER_AREA);
  if (!valid.empty()) cv::resize(valid, small_valid, size, 0, 0, cv::INTER_AREA);
  if (!valid.empty()) small_valid = small_valid == 255;
  return {even_light(small, small_valid), expand_polynomials(even_light(gray, valid))};
}

cv::Mat coarse_flow(const FlowImage& reference, const FlowImage& moving) {
  const cv::Mat &a = reference.coarse, &b = moving.coarse;
  const int columns = a.cols / kCellPx - 1, rows = a.rows / kCellPx - 1;
  cv::Mat flow(reference.polynomials.at(0).mixed.size(), CV_32FC2, cv::Scalar(0.0, 0.0));
  if (columns < 2 || rows < 2) return flow;
  const double shrink = std::max(1.0, flow.cols / static_cast<double>(kCoarseWidthPx));

  const BlockSearch search(b, 2 * kCellPx, kReachPx);
  Scores scores;
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) scores.push_back(search(a, {x * kCellPx, y * kCellPx}));
  for (int round = 0; round < kSupportRounds; ++round) scores = supported(scores, columns, rows);

  // The best motion of each block, at its centre; linear between the centres.
  cv::Mat motions(rows, columns, CV_32FC2);
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      cv::Point best;
      cv::minMaxLoc(scores[static_cast<std::size_t>(y * columns + x)], nullptr, nullptr, nullptr,
                    &best);
      motions.at<cv::Vec2f>(y, x) = {static_cast<float>((best.x - kReachPx) * shrink),
                                     static_cast<float>((best.y - kReachPx) * shrink)};
    }
  }
  // Which of the centres a pixel lies behind, and how far behind it.
  struct Between {
    int first;
    float share;
  };
  const auto between = [&](int pixel, int centres) {
    const double at =
        std::clamp(((pixel + 0.5) / shrink - kCellPx) / kCellPx, 0.0, centres - 1.001);
    const int first = static_cast<int>(at);
    return Between{first, static_cast<float>(at - first)};
  };
  std::vector<Between> across;
  for (int x = 0; x < flow.cols; ++x) across.push_back(between(x, columns));
  std::vector<cv::Vec2f> row(static_cast<std::size_t>(columns));  // of centres
  for (int y = 0; y < flow.rows; ++y) {
    const Between down = between(y, rows);
    for (int x = 0; x < columns; ++x)
      row[x] = (1.0F - down.share) * motions.at<cv::Vec2f>(down.first, x) +
               down.share * motions.at<cv::Vec2f>(down.first + 1, x);
    auto* to = flow.ptr<cv::Vec2f>(y);
    for (int x = 0; x < flow.cols; ++x) {
      const auto& [first, share] = across[x];
      to[x] = (1.0F - share) * row[first] + share * row[first + 1];
    }
  }
  return flow;
}

cv::Mat farneback_flow(const FlowImage& reference, const FlowImage& moving,
                       const cv::Mat& initial) {
  return farneback(reference.polynomials, moving.polynomials,
                   initial.empty() ? coarse_flow(reference, moving) : initial);
}

cv::Mat farneback_flow(const cv::Mat& reference, const cv::Mat& moving, const cv::Mat& initial,
                       const cv::Mat& valid) {
  check(reference.size() == moving.size(),
        "optical flow: expected two images of one size, found {} x {} and {} x {}", reference.cols,
        reference.rows, moving.cols, moving.rows);
  return farneback_flow(prepare_flow(reference, valid), prepare_flow(moving, valid), initial);
}

}  // namespace rugae
