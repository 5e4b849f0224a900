#include "recon/dense/depth_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/check.h"
#include "recon/dense/semi_global.h"
#include "recon/dense/sweep.h"

namespace rugae {
namespace {

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
/// A step of the sweep moves the wall by this much in the sources that it moves most in.
constexpr double kStepPx = 0.5;
constexpr double kFastShare = 0.75;  // of the sources move less
/// The second sweep looks this far from what the first one found, in the first one's steps.
constexpr double kSecondReachSteps = 2.0;
constexpr int kMaxReach = 64;
/// Costs of neighbours that differ by one step, and by more; scores go from -1 to 1.
constexpr SmoothnessCost kSmoothness{0.02f, 0.2f};
/// Errors that do not show in the correlation (a bent window, interpolation), assumed, in steps.
constexpr double kSystematicSteps = 0.1;
/// The first sweep's surface, before the second follows it: median over this many pixels.
constexpr int kMedianPx = 5;

/// The second look: windows, as a multiple of the first ones' radius; how far from the surface,
/// which nine times in ten is that close; what counts. Windows half as wide again as these find no
/// more; twice this sigma 0.01 more recall at 1 mm for 0.01 less precision.
constexpr double kAgainRadius = 1.5;
constexpr double kAgainReachLn = 0.03;
constexpr double kAgainScore = 2.0 / 3.0;  // of the first look's least
constexpr double kAgainSigmaShare = 0.01;
constexpr float kWhole = 0.99f;  // of a mask between pixels

/// What a sweep found, on its grid.
struct Found {
  cv::Mat depth;     // CV_32F, NaN where unknown
  cv::Mat sigma_ln;  // CV_32F, of ln depth
  double step_ln = 0.0;
};

SweepRange range_for(const StereoImage& reference, const std::vector<SweepSource>& sources,
                     const cv::Mat& surface, double reach_ln) {
  std::vector<double> motions;
  for (const SweepSource& source : sources)
    motions.push_back(motion_px(reference, source, surface));
  std::ranges::sort(motions);
  const double fast =
      motions[static_cast<std::size_t>(kFastShare * static_cast<double>(motions.size() - 1))];
  if (!(fast > 0.0)) return {};
  SweepRange range;
  range.step_ln = kStepPx / fast;
  range.reach = std::clamp(static_cast<int>(std::ceil(reach_ln / range.step_ln)), 2, kMaxReach);
  return range;
}

/// The best label and what is known of it.
struct Label {
  float place = kUnknown;  // between labels
  float sigma = kUnknown;  // labels
};

/// Of the correlation C of a window with N pixels, a parabola at its top: 2 N (1 - C) is the sum of
/// squares left between the normalised windows, so the label's variance is
///   2 (1 - C) / (N |C''|)
/// for one source; of n sources the noise of the reference, half of it, stays: (1 + 1/n) / 2.
Label label_of(const float* costs, const float* scores, int count, double window_px, int sources,
               double min_score) {
  const int best = static_cast<int>(std::min_element(costs, costs + count) - costs);
  if (best == 0 || best == count - 1) return {};
  const float score = scores[best];
  if (!(score >= static_cast<float>(min_score))) return {};
  // The top of the correlation itself where the paths lead to it: their costs change by steps,
  // which would draw the place towards whole labels.
  const float bend = 2.0f * score - scores[best - 1] - scores[best + 1];
  const float slope = scores[best + 1] - scores[best - 1];
  if (!(bend > 0.0f) || !(std::abs(slope) <= 2.0f * bend)) return {};
  Label label;
  label.place = static_cast<float>(best) + 0.5f * slope / bend;
  const double variance = (1.0 - score) * (1.0 + 1.0 / sources) / (window_px * bend);
  label.sigma = static_cast<float>(std::sqrt(variance + kSystematicSteps * kSystematicSteps));
  return label;
}

Found search(const StereoView& reference, const std::vector<const StereoView*>& sources, int level,
             const cv::Mat& surface, double reach_ln, const DenseOptions& options) {
  const StereoImage& image = reference.levels[level];
  std::vector<SweepSource> sweep_sources;
  for (const StereoView* source : sources)
    sweep_sources.push_back(
        {&source->levels[level], source->cam_from_world * reference.cam_from_world.inverse()});
  Found found{cv::Mat(image.grid.size(), CV_32F, cv::Scalar(kUnknown)),
              cv::Mat(image.grid.size(), CV_32F, cv::Scalar(kUnknown)), 0.0};
  const SweepRange range = range_for(image, sweep_sources, surface, reach_ln);
  if (range.reach == 0) return found;
  found.step_ln = range.step_ln;
  const ScoreVolume scores = sweep(image, sweep_sources, surface, range, options.window_radius_px);
  const ScoreVolume costs = path_costs(scores, kSmoothness);
  const double side = 2.0 * options.window_radius_px + 1.0;
  const int counted = std::max<int>(2, (static_cast<int>(sources.size()) + 1) / 2);
  for (int y = 0; y < image.grid.height; ++y)
    for (int x = 0; x < image.grid.width; ++x) {
      if (!std::isfinite(image.texture.at<float>(y, x))) continue;
      const Label label = label_of(costs.at(x, y), scores.at(x, y), range.count(), side * side,
                                   counted, options.min_score);
      if (!std::isfinite(label.place)) continue;
      const double offset_ln = range.step_ln * (label.place - range.reach);
      found.depth.at<float>(y, x) =
          surface.at<float>(y, x) * static_cast<float>(std::exp(offset_ln));
      found.sigma_ln.at<float>(y, x) = static_cast<float>(range.step_ln * label.sigma);
    }
  return found;
}

/// What was found, with the prior where nothing was, without single pixels, on a finer grid.
cv::Mat next_surface(const cv::Mat& depth, const cv::Mat& prior, cv::Size size) {
  cv::Mat filled = prior.clone(), smooth, finer;
  depth.copyTo(filled, depth == depth);
  cv::medianBlur(filled, smooth, kMedianPx);
  cv::GaussianBlur(smooth, smooth, {}, 1.0);
  cv::resize(smooth, finer, size, 0.0, 0.0, cv::INTER_LINEAR);
  return finer;
}

}  // namespace

DepthMap estimate_depth(const StereoView& reference, const std::vector<const StereoView*>& sources,
                        const DepthPrior& prior, const DenseOptions& options) {
  check(reference.levels.size() == kStereoLevels, "estimate_depth: {} levels, expected {}",
        reference.levels.size(), kStereoLevels);
  const PinholeGrid& grid = reference.levels[0].grid;
  DepthMap map{grid, reference.cam_from_world, cv::Mat(grid.size(), CV_32F, cv::Scalar(kUnknown)),
               cv::Mat(grid.size(), CV_32F, cv::Scalar(kUnknown))};
  if (prior.depth.empty() || sources.size() < 2) return map;
  const int coarsest = kStereoLevels - 1;
  check(prior.depth.size() == reference.levels[coarsest].grid.size(),
        "estimate_depth: the prior is not on the coarsest grid");

  cv::Mat surface = prior.depth;
  double reach_ln = prior.reach_ln;
  Found found;
  for (int level = coarsest; level >= 0; --level) {
    if (level < coarsest) {
      if (!(found.step_ln > 0.0)) return map;
      surface = next_surface(found.depth, surface, reference.levels[level].grid.size());
      reach_ln = kSecondReachSteps * found.step_ln;
    }
    found = search(reference, sources, level, surface, reach_ln, options);
  }
  for (int y = 0; y < grid.height; ++y)
    for (int x = 0; x < grid.width; ++x) {
      const float sigma_ln = found.sigma_ln.at<float>(y, x);
      if (!(sigma_ln <= static_cast<float>(options.max_sigma_share))) continue;
      map.depth.at<float>(y, x) = found.depth.at<float>(y, x);
      map.sigma.at<float>(y, x) = found.depth.at<float>(y, x) * sigma_ln;
    }
  return map;
}

cv::Mat look_again(const StereoView& reference, const std::vector<const StereoView*>& sources,
                   const cv::Mat& surface, const DenseOptions& options, DepthMap& map) {
  const int coarsest = kStereoLevels - 1;
  const cv::Size small = reference.levels[coarsest].grid.size();
  check(surface.size() == map.depth.size() && surface.type() == CV_32F,
        "look_again: the surface is not on the map's grid");
  DenseOptions again = options;
  again.window_radius_px = static_cast<int>(std::lround(kAgainRadius * options.window_radius_px));
  again.min_score = kAgainScore * options.min_score;
  cv::Mat coarse;
  cv::resize(surface, coarse, small, 0.0, 0.0, cv::INTER_AREA);
  const Found found = search(reference, sources, coarsest, coarse, kAgainReachLn, again);

  const cv::Mat known = found.depth == found.depth;
  const auto finer = [&](const cv::Mat& values) {
    cv::Mat whole(small, CV_32F, cv::Scalar(0.0)), large;
    values.copyTo(whole, known);
    cv::resize(whole, large, small * (1 << coarsest), 0.0, 0.0, cv::INTER_LINEAR);
    return large;
  };
  const cv::Mat depth = finer(found.depth), sigma_ln = finer(found.sigma_ln);
  const cv::Mat share = finer(cv::Mat(small, CV_32F, cv::Scalar(1.0)));
  cv::Mat fresh(map.depth.size(), CV_8U, cv::Scalar(0));
  for (int y = 0; y < fresh.rows; ++y)
    for (int x = 0; x < fresh.cols; ++x) {
      const float sigma_share = sigma_ln.at<float>(y, x);
      if (map.depth.at<float>(y, x) > 0.0f || !(share.at<float>(y, x) >= kWhole)) continue;
      if (!(sigma_share <= static_cast<float>(kAgainSigmaShare))) continue;
      map.depth.at<float>(y, x) = depth.at<float>(y, x);
      map.sigma.at<float>(y, x) = sigma_share * depth.at<float>(y, x);
      fresh.at<uchar>(y, x) = 255;
    }
  return fresh;
}

}  // namespace rugae
