#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "core/check.h"
#include "dataset/observations.h"
#include "recon/preprocess/preprocess.h"
#include "render/thread_clock.h"
#include "studies/measure.h"
#include "studies/measure_parts.h"
#include "studies/true_motion.h"
#include "validate/running_errors.h"

namespace rugae {
namespace {

using nlohmann::json;

struct Judged {
  Vec2 first, second, truth;  // px, of the pictures that were matched
  bool inlier = false;
};

struct PairResult {
  std::size_t matches = 0;
  std::size_t edge = 0, hidden = 0, outside = 0, nowhere = 0;  // of the matches
  std::vector<Judged> judged;                                  // the rest
  bool found = false;                                          // a homography
  std::vector<double> reprojection_px;                         // of its inliers
  std::optional<double> of_truth_mean_px;                      // likewise, of the true matches
  double covered = 0.0, covered_by_inliers = 0.0;
  double cpu_s = 0.0;
};

double mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

std::vector<double> inlier_errors_px(const ReprojectedMatches& led) {
  std::vector<double> errors;
  for (std::size_t i = 0; i < led.error_px.size(); ++i)
    if (led.inlier[i]) errors.push_back(led.error_px[i]);
  return errors;
}

// Cells of a grid over the picture, those that mostly lie where it sees.
class Grid {
 public:
  Grid(int across, const cv::Mat& valid) : across_(across), size_(valid.size()) {
    for (int v = 0; v < across; ++v)
      for (int u = 0; u < across; ++u) {
        const cv::Mat cell =
            valid(cv::Range(v * size_.height / across, (v + 1) * size_.height / across),
                  cv::Range(u * size_.width / across, (u + 1) * size_.width / across));
        counts_.push_back(2 * cv::countNonZero(cell) >= static_cast<int>(cell.total()));
      }
    total_ = std::ranges::count(counts_, true);
  }

  // Share of the cells in which a point lies.
  double covered(const std::vector<Vec2>& points) const {
    std::vector<bool> hit(counts_.size(), false);
    for (const Vec2& p : points) {
      const int u = static_cast<int>(p.x() * across_ / size_.width),
                v = static_cast<int>(p.y() * across_ / size_.height);
      if (u >= 0 && v >= 0 && u < across_ && v < across_)
        hit[static_cast<std::size_t>(v * across_ + u)] = true;
    }
    std::size_t count = 0;
    for (std::size_t i = 0; i < hit.size(); ++i) count += hit[i] && counts_[i] ? 1 : 0;
    return total_ == 0 ? 0.0 : static_cast<double>(count) / static_cast<double>(total_);
  }

 private:
  int across_;
  cv::Size size_;
  std::vector<bool> counts_;
  std::ptrdiff_t total_ = 0;
};

class FeatureMeasure {
 public:
  FeatureMeasure(const std::filesystem::path& dataset, const Matcher& matcher,
                 const FeatureMeasureOptions& options)
      : matcher_(matcher),
        options_(options),
        motion_(dataset),
        frames_(Observations::open(dataset), options.preprocess.value_or(as_observed())),
        observed_(motion_.truth().camera().lens),
        picture_(frames_.lens()),
        grid_(options.grid, frames_.valid()) {
    check(frames_.size() == motion_.truth().size(), "{}: {} frames and {} true poses",
          dataset.string(), frames_.size(), motion_.truth().size());
    check(frames_.size() > options.step, "{}: {} frames, expected more than the step of {}",
          dataset.string(), frames_.size(), options.step);
  }

  int pairs() const {
    return (frames_.size() - options_.step + options_.stride - 1) / options_.stride;
  }

  PairResult pair(int k) const {
    PairResult result;
    const int i = k * options_.stride, j = i + options_.step;
    const cv::Mat first = frames_.gray(i), second = frames_.gray(j);
    const double start_s = thread_seconds();
    const FeatureMatches matches = matcher_(i, j, first, second, frames_.valid());
    result.cpu_s = thread_seconds() - start_s;
    result.matches = matches.first_px.size();
    result.covered = grid_.covered(matches.first_px);

    const ReprojectedMatches led = reproject(matches, options_.seed, options_.ransac_threshold_px);
    result.found = led.homography_found;
    std::vector<Vec2> inliers;
    for (std::size_t m = 0; m < led.inlier.size(); ++m)
      if (led.inlier[m]) inliers.push_back(matches.first_px[m]);
    result.reprojection_px = inlier_errors_px(led);
    result.covered_by_inliers = grid_.covered(inliers);

    judge(i, j, matches, led, result);
    FeatureMatches truth;
    for (const Judged& match : result.judged) {
      truth.first_px.push_back(match.first);
      truth.second_px.push_back(match.truth);
    }
    const ReprojectedMatches best = reproject(truth, options_.seed, options_.ransac_threshold_px);
    if (best.homography_found) result.of_truth_mean_px = mean(inlier_errors_px(best));
    return result;
  }

 private:
  // Between the pictures that are matched and the frames as observed.
  std::optional<Vec2> to_observed(const Vec2& px) const {
    if (!options_.preprocess) return px;
    const auto ray = picture_.unproject(px);
    return ray ? observed_.project(*ray) : std::nullopt;
  }
  std::optional<Vec2> to_picture(const Vec2& px) const {
    if (!options_.preprocess) return px;
    const auto ray = observed_.unproject(px);
    return ray ? picture_.project(*ray) : std::nullopt;
  }

  void judge(int i, int j, const FeatureMatches& matches, const ReprojectedMatches& led,
             PairResult& result) const {
    // Every match, and the corners of the square of a pixel around it.
    constexpr double kHalf_px = 0.5;
    const Vec2 around[] = {Vec2(0, 0), Vec2(-kHalf_px, -kHalf_px), Vec2(kHalf_px, -kHalf_px),
                           Vec2(-kHalf_px, kHalf_px), Vec2(kHalf_px, kHalf_px)};
    constexpr std::size_t kAround = std::size(around);
    const Vec2 beyond(-1e6, -1e6);  // meets no wall
    std::vector<Vec2> pixels;
    for (const Vec2& first : matches.first_px) {
      const Vec2 at = to_observed(first).value_or(beyond);
      for (const Vec2& a : around) pixels.emplace_back(at + a);
    }
    const std::vector<TrueLanding> landings = motion_.follow(i, j, pixels);
    for (std::size_t k = 0; k < matches.first_px.size(); ++k) {
      const TrueLanding& landing = landings[kAround * k];
      const Vec2 moved = landing.pixel - pixels[kAround * k];
      bool edge = false;
      for (std::size_t a = 1; a < kAround; ++a) {
        const TrueLanding& beside = landings[kAround * k + a];
        edge = edge || beside.sight == TrueLanding::Sight::nowhere ||
               !((beside.pixel - pixels[kAround * k + a] - moved).norm() <= options_.edge_px);
      }
      const std::optional<Vec2> truth =
          landing.sight == TrueLanding::Sight::seen ? to_picture(landing.pixel) : std::nullopt;
      if (landing.sight == TrueLanding::Sight::nowhere)
        ++result.nowhere;
      else if (edge)
        ++result.edge;
      else if (landing.sight == TrueLanding::Sight::hidden)
        ++result.hidden;
      else if (!truth)
        ++result.outside;
      else
        result.judged.push_back({matches.first_px[k], matches.second_px[k], *truth,
                                 led.homography_found && led.inlier[k] != 0});
    }
  }

  const Matcher& matcher_;
  FeatureMeasureOptions options_;
  TrueMotion motion_;
  FrameSource frames_;
  LensProjector observed_, picture_;
  Grid grid_;
};

// Adds the pairs up in their order.
class Sums {
 public:
  void add(const PairResult& pair) {
    ++pairs_;
    matches_ += pair.matches;
    edge_ += pair.edge;
    hidden_ += pair.hidden;
    outside_ += pair.outside;
    nowhere_ += pair.nowhere;
    cpu_s_ += pair.cpu_s;
    covered_ += pair.covered;
    covered_by_inliers_ += pair.covered_by_inliers;
    if (pair.found) {
      pair_px_.add(mean(pair.reprojection_px));
      for (const double error : pair.reprojection_px) inlier_px_.add(error);
    }
    if (pair.of_truth_mean_px) of_truth_px_.add(*pair.of_truth_mean_px);
    for (const Judged& match : pair.judged) {
      const double error_px = (match.second - match.truth).norm();
      endpoint_px_.add(error_px);
      if (match.inlier) inlier_endpoint_px_.add(error_px);
      motion_px_.add((match.truth - match.first).norm());
    }
  }

  json to_json() const {
    const auto per_pair = [this](double sum) { return sum / static_cast<double>(pairs_); };
    const auto of_matches = [this](std::size_t part) {
      return matches_ == 0 ? json()
                           : json(static_cast<double>(part) / static_cast<double>(matches_));
    };
    const ErrorStats pairs = pair_px_.stats(), inliers = inlier_px_.stats();
    const double variance = std::max(0.0, pairs.rmse * pairs.rmse - pairs.mean * pairs.mean);
    json out = {
        {"pairs", pairs_},
        {"homography_share", per_pair(static_cast<double>(pairs.count))},
        {"matches_per_pair", per_pair(static_cast<double>(matches_))},
        {"inliers_per_pair", per_pair(static_cast<double>(inliers.count))},
        {"reprojection",
         {{"mean_px", known(pairs.mean, pairs.count)},
          {"std_px", known(std::sqrt(variance), pairs.count)},
          {"pooled_mean_px", known(inliers.mean, inliers.count)},
          {"pooled_median_px", known(inliers.median, inliers.count)},
          {"of_truth_mean_px", known(of_truth_px_.stats().mean, of_truth_px_.count())}}},
        {"endpoint", {{"all", endpoint(endpoint_px_)}, {"inliers", endpoint(inlier_endpoint_px_)}}},
        {"judged_share", of_matches(endpoint_px_.count())},
        {"edge_share", of_matches(edge_)},
        {"hidden_share", of_matches(hidden_)},
        {"outside_share", of_matches(outside_)},
        {"nowhere_share", of_matches(nowhere_)},
        {"true_motion_mean_px", known(motion_px_.stats().mean, motion_px_.count())},
        {"coverage",
         {{"all_share", per_pair(covered_)}, {"inliers_share", per_pair(covered_by_inliers_)}}}};
    const json time = {{"cpu_ms_per_pair", per_pair(1e3 * cpu_s_)}, {"pairs", pairs_}};
    return {{"features", out}, {"time", time}};
  }

 private:
  static json endpoint(const RunningErrors& errors) {
    const ErrorStats stats = errors.stats();
    const auto share = [&](std::size_t k) {
      return stats.count == 0 ? json() : json(errors.share_below(k));
    };
    return {{"mean_px", known(stats.mean, stats.count)},
            {"median_px", known(stats.median, stats.count)},
            {"rmse_px", known(stats.rmse, stats.count)},
            {"max_px", known(stats.max, stats.count)},
            {"within_1px_share", share(0)},
            {"within_3px_share", share(1)},
            {"matches", stats.count}};
  }

  std::size_t pairs_ = 0, matches_ = 0, edge_ = 0, hidden_ = 0, outside_ = 0, nowhere_ = 0;
  double cpu_s_ = 0.0, covered_ = 0.0, covered_by_inliers_ = 0.0;
  RunningErrors pair_px_, inlier_px_, of_truth_px_, motion_px_;
  RunningErrors endpoint_px_{{1.0, 3.0}}, inlier_endpoint_px_{{1.0, 3.0}};
};

}  // namespace

void FeatureMeasureOptions::check() const {
  rugae::check(step >= 1, "features: step is {}, expected at least 1", step);
  rugae::check(stride >= 1, "features: stride is {}, expected at least 1", stride);
  rugae::check(ransac_threshold_px > 0.0, "features: ransac_threshold_px is {}, expected above 0",
               ransac_threshold_px);
  rugae::check(grid >= 1 && grid <= 64, "features: grid is {}, expected 1 to 64", grid);
  rugae::check(edge_px > 0.0, "features: edge_px is {}, expected above 0", edge_px);
  if (preprocess) preprocess->check();
}

json measure_matches(const std::filesystem::path& dataset, const std::string& name,
                     const Matcher& matcher, const FeatureMeasureOptions& options,
                     Progress& progress) {
  options.check();
  const FeatureMeasure measure(dataset, matcher, options);
  progress.begin(name, static_cast<std::size_t>(measure.pairs()));
  Sums sums;
  in_batches(
      measure.pairs(), progress, [&](int k) { return measure.pair(k); },
      [&](const PairResult& result) { sums.add(result); });
  progress.end();
  return sums.to_json();
}

json measure_features(const std::filesystem::path& dataset, FeatureMethod method,
                      const FeatureMeasureOptions& options, Progress& progress) {
  const auto matcher = [method](int, int, const cv::Mat& first, const cv::Mat& second,
                                const cv::Mat& valid) {
    return match_features(method, first, second, valid);
  };
  return measure_matches(dataset, name_of(method), matcher, options, progress);
}

}  // namespace rugae
