#pragma once
// Evaluation of features and flow, the paper's algorithm 1: match, homography by RANSAC,
// re-project, measure.

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "core/types.h"

namespace rugae {

enum class FeatureMethod { sift, surf, orb, hog, farneback, lucas_kanade };
inline constexpr FeatureMethod kFeatureMethods[] = {
    FeatureMethod::sift, FeatureMethod::surf,      FeatureMethod::orb,
    FeatureMethod::hog,  FeatureMethod::farneback, FeatureMethod::lucas_kanade};
std::string name_of(FeatureMethod method);

/// Points of two images taken to be the same, (0.5, 0.5) convention.
struct FeatureMatches {
  std::vector<Vec2> first_px, second_px;
};

/// Step 1: matches between two CV_8U images of one size. Descriptors (SIFT, SURF by dlib, ORB, HOG
/// at corners) are matched by nearest neighbour with Lowe's ratio test (0.8) both ways; the flows
/// are sampled at the corners (Shi and Tomasi) of the first image. Points near or beyond the border
/// of `valid` (CV_8U, of both images; empty: everywhere) are left out: the edge of a field stop is
/// where it was in every image.
FeatureMatches match_features(FeatureMethod method, const cv::Mat& first, const cv::Mat& second,
                              const cv::Mat& valid = {});

struct FeatureScore {
  int matches = 0, inliers = 0;
  bool homography_found = false;  // false: the errors below mean nothing
  double mean_error_px = 0.0;     // re-projection error of the inliers, second image onto the first
  double median_error_px = 0.0;
  double cpu_s = 0.0;  // of matching, this thread
};

/// Steps 2 to 4. Only inliers count, as in the paper's table: a method with few matches may still
/// have a small error, so look at the counts as well.
FeatureScore evaluate_feature(FeatureMethod method, const cv::Mat& first, const cv::Mat& second,
                              std::uint64_t seed, double ransac_threshold_px = 3.0,
                              const cv::Mat& valid = {});

}  // namespace rugae
