#pragma once
// Single stages of the reconstruction against exact truth, on a dataset, without a reconstruction:
// features (the paper's table of re-projection errors), reflections, vignetting.
//
// Every function takes a dataset's folder, throws Error for one that lacks what it needs or for
// options out of range, and returns metrics by name with their units, as evaluate() does; what
// could not be measured is null. The same bytes for any number of threads, but for what stands
// under "time". Memory does not grow with the frames.

#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "recon/features.h"
#include "recon/options.h"

namespace rugae {

struct FeatureMeasureOptions {
  int step = 1;    // pairs (i, i + step)
  int stride = 1;  // of every so many frames i, beginning with the first
  std::optional<PreprocessOptions> preprocess;  // empty: the frames as observed
  double ransac_threshold_px = 3.0;
  int grid = 8;  // cells across and down, of the coverage
  // A match is not judged where the true motion within half a pixel of it differs by more than
  // this: it lies on an edge of depth, and either side would be right.
  double edge_px = 0.5;
  std::uint64_t seed = 1;  // of RANSAC
  void check() const;
};

/// Algorithm 1 of the paper for every pair (i, i + step) of the dataset, and what its authors did
/// not have: the error against the true motion.
///
/// {"features": {"pairs", "homography_share": of the pairs,
///   "matches_per_pair", "inliers_per_pair": 0 where no homography was found,
///   "reprojection": {"mean_px", "std_px": over the pairs with a homography, of the mean error of
///     the pair's inliers; "pooled_mean_px", "pooled_median_px": over all inliers;
///     "of_truth_mean_px": as mean_px, of the true matches at the same places: what a curved wall
///     leaves to a homography however good the matches are},
///   "endpoint": {"all", "inliers": each {"mean_px", "median_px", "rmse_px", "max_px",
///     "within_1px_share", "within_3px_share", "matches"}}: |second - true place of the first|,
///     over the matches that are judged (all pairs; inliers of those with a homography),
///   "judged_share", "edge_share", "hidden_share", "outside_share", "nowhere_share": of all
///   matches;
///     only those whose wall point is seen in the second frame, off edges, are judged,
///   "true_motion_mean_px": of the judged matches, the end-point error of no motion at all,
///   "coverage": {"all_share", "inliers_share"}: mean share of the grid's cells with a match},
///  "time": {"cpu_ms_per_pair": of matching, "pairs"}}
nlohmann::json measure_features(const std::filesystem::path& dataset, FeatureMethod method,
                                const FeatureMeasureOptions& options, Progress& progress);

/// Matches between the pictures (CV_8U) of frames i and j; `valid` as for match_features(). Called
/// from many threads.
using Matcher = std::function<FeatureMatches(int i, int j, const cv::Mat& first,
                                             const cv::Mat& second, const cv::Mat& valid)>;
/// The same for matches from anywhere; `name` is shown as progress.
nlohmann::json measure_matches(const std::filesystem::path& dataset, const std::string& name,
                               const Matcher& matcher, const FeatureMeasureOptions& options,
                               Progress& progress);

struct ReflectionMeasureOptions {
  ReflectionOptions reflections;
  // The wet layer's share of a pixel's luminance from which on it counts as specular; the masks'
  // own share is that of render/radiance.h.
  std::vector<double> shares{0.05, 0.1, 0.25, 0.5, 0.75, 0.9};
  void check() const;
};

/// detect_reflections() on every frame as observed against the true specular mask, inside the field
/// stop.
///
/// {"reflections": {"frames", "frames_with_true", "frames_with_found", "true_share", "found_share":
///   of the pixels,
///   "pooled": over the pixels of all frames, {"precision", "recall", "f1", "iou"},
///   "mean": the same of every frame, averaged over the frames in which they are defined,
///   "saturated", "unsaturated": pooled, over the pixels that (do not) reach the converter's top,
///   "by_share": {"above_25_percent": {"true_share", "precision", ...}, ...}, pooled; null without
///     the labels diffuse and specular (and indirect, with light.bounces above 0)}}
nlohmann::json measure_reflections(const std::filesystem::path& dataset,
                                   const ReflectionMeasureOptions& options, Progress& progress);

struct VignettingMeasureOptions {
  PreprocessOptions preprocess;  // devignette must be on
  void check() const;
};

/// The profile that preprocessing estimates against the camera's true one, over the pixels of the
/// preprocessed picture. Profiles are of stored values: the true one is raised to the exponent that
/// the tone curve has, ring by ring, at the values of the frames that the estimate is made from.
///
/// The estimate cannot tell the fall-off of the lens from that of a light which moves with the
/// camera. What the light alone would give is estimated in the same way from pictures of a wall of
/// one colour, with the true depths, normals and lights and without the lens' fall-off.
///
/// {"vignetting": {"frames": used,
///   "rms_ln_before": RMS of ln V of the true profile about its mean: the fall-off in the frames,
///   "rms_ln_after": of ln(true / estimated) about its mean: what the correction leaves,
///   "rms_ln_after_light": of ln(true light / estimated) about its mean, light the profile of the
///     light alone: what neither lens nor light explain,
///   "light_share": of the squared error rms_ln_after^2, what the light explains, 1 at most,
///   "corner_true", "corner_estimated", "corner_light": V at the pixel farthest from the centre,
///   "corner_ln_error": ln(estimated / true) there, all being 1 at the centre,
///   "corner_ln_error_light": ln(estimated / (true light)) there,
///   "corner_radius_share": where it is, of half the diagonal,
///   "exponent_mean": of the tone curve,
///   "profile": {"radius_share", "estimated", "true", "light"}: for plots}}
/// The parts of the light are null without the labels depth and normals.
nlohmann::json measure_vignetting(const std::filesystem::path& dataset,
                                  const VignettingMeasureOptions& options, Progress& progress);

}  // namespace rugae
