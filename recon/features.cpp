#include "recon/features.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/objdetect.hpp>
#include <opencv2/video/tracking.hpp>

#include "core/check.h"
#include "core/random.h"
#include "recon/flow.h"
#include "recon/surf.h"

namespace rugae {
namespace {

constexpr float kRatio = 0.8F;  // Lowe's, IJCV 2004
constexpr int kMaxPoints = 2000;
constexpr int kHogSidePx = 32;
constexpr std::size_t kMinMatches = 4;  // fix a homography
constexpr int kStopPx = 16;             // so near to a field stop its edge is in the description

struct Described {
  std::vector<cv::Point2f> points;  // integer centres
  cv::Mat descriptors;              // a row each
};

// What is not near the stop; empty: everywhere.
cv::Mat inside(const cv::Mat& valid) {
  cv::Mat inner;
  if (valid.empty()) return inner;
  cv::erode(valid, inner, cv::Mat::ones(2 * kStopPx + 1, 2 * kStopPx + 1, CV_8U), {-1, -1}, 1,
            cv::BORDER_CONSTANT, cv::Scalar(255));
  return inner;
}

bool is_inside(const cv::Mat& inner, const Vec2& p) {
  if (inner.empty()) return true;
  return p.x() >= 0.0 && p.y() >= 0.0 && p.x() < inner.cols && p.y() < inner.rows &&
         inner.at<unsigned char>(static_cast<int>(p.y()), static_cast<int>(p.x())) != 0;
}

std::vector<cv::Point2f> corners(const cv::Mat& image, const cv::Mat& inner) {
  std::vector<cv::Point2f> points;
  cv::goodFeaturesToTrack(image, points, kMaxPoints, 0.005, 7.0, inner);
  return points;
}

Described describe(const cv::Ptr<cv::Feature2D>& feature, const cv::Mat& image,
                   const cv::Mat& inner) {
  Described d;
  std::vector<cv::KeyPoint> keypoints;
  feature->detectAndCompute(image, inner, keypoints, d.descriptors);
  cv::KeyPoint::convert(keypoints, d.points);
  return d;
}

// Histograms of oriented gradients (Dalal and Triggs, CVPR 2005, doi:10.1109/CVPR.2005.177) of the
// window around each corner.
Described describe_hog(const cv::Mat& image, const cv::Mat& inner) {
  const cv::HOGDescriptor hog({kHogSidePx, kHogSidePx}, {16, 16}, {8, 8}, {8, 8}, 9);
  Described d;
  const float half = 0.5F * kHogSidePx;
  std::vector<cv::Point> corner_of_window;
  for (const cv::Point2f& p : corners(image, inner)) {
    const cv::Point at(cvRound(p.x - half), cvRound(p.y - half));
    if (at.x < 0 || at.y < 0 || at.x + kHogSidePx > image.cols || at.y + kHogSidePx > image.rows)
      continue;
    corner_of_window.push_back(at);
    d.points.push_back(p);
  }
  if (d.points.empty()) return d;
  std::vector<float> values;
  hog.compute(image, values, {8, 8}, {}, corner_of_window);
  d.descriptors = cv::Mat(values, true).reshape(1, static_cast<int>(d.points.size()));
  return d;
}

Described describe_surf(const cv::Mat& image, const cv::Mat& inner) {
  Described d;
  for (const SurfPoint& s : surf_points(image, kMaxPoints)) {
    if (!is_inside(inner, s.pixel)) continue;
    d.points.emplace_back(static_cast<float>(s.pixel.x() - 0.5),
                          static_cast<float>(s.pixel.y() - 0.5));
    d.descriptors.push_back(cv::Mat(s.descriptor, true).reshape(1, 1));
  }
  return d;
}

Described describe(FeatureMethod method, const cv::Mat& image, const cv::Mat& inner) {
  switch (method) {
    case FeatureMethod::sift:
      return describe(cv::SIFT::create(kMaxPoints), image, inner);
    case FeatureMethod::orb:
      return describe(cv::ORB::create(kMaxPoints), image, inner);
    case FeatureMethod::surf:
      return describe_surf(image, inner);
    default:
      return describe_hog(image, inner);
  }
}

// For each row of `from` its nearest in `to`, -1 where the second nearest is about as near.
std::vector<int> nearest(const cv::Mat& from, const cv::Mat& to, int norm) {
  std::vector<int> result(static_cast<std::size_t>(from.rows), -1);
  std::vector<std::vector<cv::DMatch>> found;
  cv::BFMatcher(norm).knnMatch(from, to, found, 2);
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i].size() == 2 && found[i][0].distance < kRatio * found[i][1].distance)
      result[i] = found[i][0].trainIdx;
  }
  return result;
}

void add(FeatureMatches& matches, const cv::Point2f& a, const cv::Point2f& b) {
  matches.first_px.emplace_back(a.x + 0.5, a.y + 0.5);
  matches.second_px.emplace_back(b.x + 0.5, b.y + 0.5);
}

FeatureMatches match_flow(FeatureMethod method, const cv::Mat& first, const cv::Mat& second,
                          const cv::Mat& valid) {
  FeatureMatches matches;
  const cv::Mat inner = inside(valid);
  const std::vector<cv::Point2f> points = corners(first, inner);
  if (points.empty()) return matches;
  if (method == FeatureMethod::farneback) {
    const cv::Mat flow = farneback_flow(first, second, {}, valid);
    for (const cv::Point2f& p : points) {
      const cv::Vec2f f = flow.at<cv::Vec2f>(cvRound(p.y), cvRound(p.x));
      const cv::Point2f q = p + cv::Point2f(f[0], f[1]);
      if (is_inside(inner, Vec2(q.x + 0.5, q.y + 0.5))) add(matches, p, q);
    }
    return matches;
  }
  std::vector<cv::Point2f> there;
  std::vector<unsigned char> found;
  cv::calcOpticalFlowPyrLK(first, second, points, there, found, cv::noArray(), {21, 21}, 4);
  for (std::size_t i = 0; i < points.size(); ++i)
    if (found[i] && is_inside(inner, Vec2(there[i].x + 0.5, there[i].y + 0.5)))
      add(matches, points[i], there[i]);
  return matches;
}

}  // namespace

std::string name_of(FeatureMethod method) {
  switch (method) {
    case FeatureMethod::sift:
      return "SIFT";
    case FeatureMethod::surf:
      return "SURF";
    case FeatureMethod::orb:
      return "ORB";
    case FeatureMethod::hog:
      return "HOG";
    case FeatureMethod::farneback:
      return "Farneback";
    case FeatureMethod::lucas_kanade:
      return "Lucas-Kanade";
  }
  fail("feature method {}: not known", static_cast<int>(method));
}

FeatureMatches match_features(FeatureMethod method, const cv::Mat& first, const cv::Mat& second,
                              const cv::Mat& valid) {
  check(first.type() == CV_8U && second.type() == CV_8U && first.size() == second.size(),
        "features: expected two 8-bit gray images of one size, found {} x {} and {} x {}",
        first.cols, first.rows, second.cols, second.rows);
  if (method == FeatureMethod::farneback || method == FeatureMethod::lucas_kanade)
    return match_flow(method, first, second, valid);
  FeatureMatches matches;
  const cv::Mat inner = inside(valid);
  const Described a = describe(method, first, inner), b = describe(method, second, inner);
  if (a.descriptors.rows < 2 || b.descriptors.rows < 2) return matches;
  const int norm = method == FeatureMethod::orb ? cv::NORM_HAMMING : cv::NORM_L2;
  const std::vector<int> forward = nearest(a.descriptors, b.descriptors, norm);
  const std::vector<int> backward = nearest(b.descriptors, a.descriptors, norm);
  for (std::size_t i = 0; i < forward.size(); ++i) {
    const int j = forward[i];
    if (j >= 0 && backward[static_cast<std::size_t>(j)] == static_cast<int>(i))
      add(matches, a.points[i], b.points[static_cast<std::size_t>(j)]);
  }
  return matches;
}

ReprojectedMatches reproject(const FeatureMatches& matches, std::uint64_t seed,
                             double ransac_threshold_px) {
  ReprojectedMatches result;
  if (matches.first_px.size() < kMinMatches) return result;
  std::vector<cv::Point2d> from, to;
  for (std::size_t i = 0; i < matches.first_px.size(); ++i) {
    from.emplace_back(matches.second_px[i].x(), matches.second_px[i].y());
    to.emplace_back(matches.first_px[i].x(), matches.first_px[i].y());
  }
  cv::UsacParams ransac;
  ransac.isParallel = false;
  ransac.maxIterations = 2000;
  ransac.threshold = ransac_threshold_px;
  ransac.sampler = cv::SAMPLING_UNIFORM;
  ransac.score = cv::SCORE_METHOD_MSAC;
  ransac.randomGeneratorState =
      static_cast<int>(random_words(seed, Purpose::recon_ransac, 0, 0)[0] >> 1);
  cv::Mat mask;
  const cv::Mat h = cv::findHomography(from, to, mask, ransac);
  if (h.empty() || mask.total() != from.size()) return result;
  const int inliers = cv::countNonZero(mask);
  if (inliers < static_cast<int>(kMinMatches)) return result;
  std::vector<cv::Point2d> reprojected;
  cv::perspectiveTransform(from, reprojected, h);
  for (std::size_t i = 0; i < from.size(); ++i) {
    result.error_px.push_back(cv::norm(reprojected[i] - to[i]));
    result.inlier.push_back(mask.at<unsigned char>(static_cast<int>(i)) != 0 ? 1 : 0);
  }
  result.homography_found = true;
  result.inliers = inliers;
  return result;
}

}  // namespace rugae
