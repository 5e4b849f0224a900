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

/// What a homography fitted to matches makes of them.
struct ReprojectedMatches {
  bool homography_found = false;  // false: there is nothing below
  std::vector<double> error_px;   // of every match: second point led onto the first image, to the
                                  // first point
  std::vector<unsigned char> inlier;  // of every match: 1 where RANSAC took it for right
  int inliers = 0;
};

/// Steps 2 to 4, for all matches: the homography by RANSAC (OpenCV's USAC with uniform sampling and
/// MSAC scores; the same for the same seed). The paper's table counts the inliers alone, and a
/// method with few matches may still have a small error there: look at the counts as well.
ReprojectedMatches reproject(const FeatureMatches& matches, std::uint64_t seed,
                             double ransac_threshold_px = 3.0);

}  // namespace rugae
