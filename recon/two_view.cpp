#include "recon/two_view.h"

#include <algorithm>
#include <limits>
#include <opencv2/calib3d.hpp>

#include "recon/bundle.h"
#include "recon/triangulation.h"

namespace rugae {
namespace {

constexpr int kMinCorrespondences = 8;
constexpr double kRansacConfidence = 0.9999;

Mat3 to_eigen(const cv::Mat& m) {
  Mat3 r;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) r(i, j) = m.at<double>(i, j);
  return r;
}

struct Candidate {
  Mat3 rotation;
  Vec3 translation;
  bool planar;
};

// Four poses of an essential matrix, and up to four of a homography between rays.
std::vector<Candidate> candidates(const std::vector<Vec2>& first, const std::vector<Vec2>& second,
                                  double focal_px, double threshold_px) {
  std::vector<cv::Point2d> a, b;
  for (std::size_t i = 0; i < first.size(); ++i) {
    a.emplace_back(focal_px * first[i].x(), focal_px * first[i].y());
    b.emplace_back(focal_px * second[i].x(), focal_px * second[i].y());
  }
  const cv::Mat k = (cv::Mat_<double>(3, 3) << focal_px, 0, 0, 0, focal_px, 0, 0, 0, 1);
  std::vector<Candidate> result;
  const cv::Mat essential =
      cv::findEssentialMat(a, b, k, cv::RANSAC, kRansacConfidence, threshold_px);
  for (int row = 0; row + 3 <= essential.rows; row += 3) {
    cv::Mat r1, r2, t;
    cv::decomposeEssentialMat(essential.rowRange(row, row + 3), r1, r2, t);
    const Vec3 translation(t.at<double>(0), t.at<double>(1), t.at<double>(2));
    for (const cv::Mat& r : {r1, r2})
      for (const double sign : {1.0, -1.0})
        result.push_back({to_eigen(r), sign * translation, false});
  }
  const cv::Mat homography = cv::findHomography(a, b, cv::RANSAC, threshold_px);
  if (!homography.empty()) {
    std::vector<cv::Mat> rotations, translations, normals;
    cv::decomposeHomographyMat(homography, k, rotations, translations, normals);
    for (std::size_t i = 0; i < rotations.size(); ++i) {
      const Vec3 t(translations[i].at<double>(0), translations[i].at<double>(1),
                   translations[i].at<double>(2));
      if (!(t.norm() > 1e-6)) continue;  // pure rotation: no baseline
      result.push_back({to_eigen(rotations[i]), t.normalized(), true});
    }
  }
  return result;
}

TwoView judge(const Rigid3& second_from_first, const std::vector<Vec2>& first,
              const std::vector<Vec2>& second, double threshold, bool planar) {
  TwoView view;
  view.second_from_first = second_from_first;
  view.planar = planar;
  const std::size_t n = first.size();
  view.inlier.assign(n, 0);
  view.points.assign(n, Vec3::Constant(std::numeric_limits<double>::quiet_NaN()));
  std::vector<double> parallaxes;
  for (std::size_t i = 0; i < n; ++i) {
    const std::vector<Sight> sights = {{Rigid3{}, first[i]}, {second_from_first, second[i]}};
    const auto robust = triangulate_robust(sights, threshold, 0.0);
    if (!robust) continue;
    view.inlier[i] = 1;
    view.points[i] = robust->point;
    ++view.inliers;
    parallaxes.push_back(parallax_rad(sights, robust->point));
  }
  if (!parallaxes.empty()) {
    const auto middle = parallaxes.begin() + static_cast<std::ptrdiff_t>(parallaxes.size() / 2);
    std::nth_element(parallaxes.begin(), middle, parallaxes.end());
    view.median_parallax_rad = *middle;
  }
  return view;
}

// Adjusts the second camera and the inliers' points; the length of the baseline is set back to 1.
Rigid3 refined(const TwoView& view, const std::vector<Vec2>& first, const std::vector<Vec2>& second,
               double focal_px) {
  Structure structure;
  structure.frames = {0, 1};
  structure.placed = {true, true};
  structure.cam_from_world = {Rigid3{}, view.second_from_first};
  for (std::size_t i = 0; i < first.size(); ++i) {
    if (!view.inlier[i]) continue;
    Track track;
    track.observations = {{0, Vec2::Zero(), first[i]}, {1, Vec2::Zero(), second[i]}};
    track.point = view.points[i];
    track.triangulated = true;
    structure.tracks.push_back(std::move(track));
  }
  BundleScope scope;
  scope.max_iterations = 20;
  bundle_adjust(structure, focal_px, BundleOptions{}, scope);
  Rigid3 pose = structure.cam_from_world[1];
  const double length = pose.translation.norm();
  if (!(length > 0.0)) return view.second_from_first;
  pose.translation /= length;
  return pose;
}

}  // namespace

std::optional<TwoView> two_view(const std::vector<Vec2>& first, const std::vector<Vec2>& second,
                                double focal_px, double threshold_px) {
  if (first.size() < kMinCorrespondences) return std::nullopt;
  const double threshold = threshold_px / focal_px;
  std::optional<TwoView> best;
  for (const Candidate& c : candidates(first, second, focal_px, threshold_px)) {
    const TwoView rough = judge({c.rotation, c.translation}, first, second, threshold, c.planar);
    if (rough.inliers < kMinCorrespondences) continue;
    // A wrong member of the family puts most points behind a camera: no need to refine it.
    if (best && 2 * rough.inliers < best->inliers) continue;
    TwoView fine =
        judge(refined(rough, first, second, focal_px), first, second, threshold, c.planar);
    if (fine.inliers < rough.inliers) fine = rough;
    if (!best || fine.inliers > best->inliers) best = std::move(fine);
  }
  if (best && best->inliers < kMinCorrespondences) return std::nullopt;
  return best;
}

}  // namespace rugae
