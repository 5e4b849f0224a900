#include "recon/dense/wall_patch.h"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "recon/dense/moving_keyframes.h"
#include "recon/flow.h"
#include "recon/tracks.h"

namespace rugae {
namespace {

constexpr int kPlanePoints = 12;        // nearest in the picture, from which a tangent plane comes
constexpr int kPlaneRounds = 3;         // of weighing down what lies off it
constexpr double kPlaneShare = 0.03;    // of the depth: points further off the plane count less
constexpr double kMinIncidence = 0.26;  // cosine, 75 degrees: more oblique pieces show nothing
constexpr double kMinScale = 0.5, kMaxScale = 2.0;
constexpr int kCoarseHalfPx = 10;    // of the squares kept: a search template at half its size
constexpr std::size_t kAtOnce = 16;  // key frames held at a time
/// In a picture narrower than this noise hides the texture of a patch; smoothed, three times as
/// many are registered.
constexpr int kNarrowPx = 320;
constexpr double kSmoothingPx = 0.8;

constexpr double kReferenceWidthPx = 640.0;
constexpr double kRadiusPx = 12.0;       // of the registration, at 640 px width
constexpr double kMaxMotionPx = 4.0;     // from its start, likewise
constexpr double kLeastRadiusPx = 7.0;   // of any picture: fewer pixels fix no place, as for tracks
constexpr double kLeastMotionPx = 2.5;   // likewise: their places are no nearer in pixels
constexpr double kMinCorrelation = 0.7;  // of what is then judged by consensus

struct Point {
  int track;
  Vec2 pixel, ray;
  double depth;
};

struct InverseDepthPlane {
  Vec3 plane;              // plane . X = 1
  double slope_sigma = 0;  // of a and b, by what the points stray from the plane
};

// 1 / z = a x + b y + c over rays (x, y, 1) is exact for a plane. The slope comes from the points
// around, the plane goes through the point itself.
std::optional<InverseDepthPlane> inverse_depth_plane(const Point& centre,
                                                     const std::vector<Point>& points) {
  std::vector<std::pair<double, const Point*>> near;
  for (const Point& p : points)
    if (p.track != centre.track) near.emplace_back((p.pixel - centre.pixel).squaredNorm(), &p);
  if (near.size() < static_cast<std::size_t>(kPlanePoints)) return std::nullopt;
  std::nth_element(
      near.begin(), near.begin() + kPlanePoints - 1, near.end(), [](const auto& a, const auto& b) {
        return a.first != b.first ? a.first < b.first : a.second->track < b.second->track;
      });
  std::vector<double> weight(kPlanePoints, 1.0);
  Vec2 slope = Vec2::Zero();
  double slope_sigma = 0.0;
  const double inverse = 1.0 / centre.depth;
  for (int round = 0; round < kPlaneRounds; ++round) {
    Mat2 normal = Mat2::Zero();
    Vec2 right = Vec2::Zero();
    for (int i = 0; i < kPlanePoints; ++i) {
      const Point& p = *near[static_cast<std::size_t>(i)].second;
      const Vec2 d = p.ray - centre.ray;
      normal += weight[i] * d * d.transpose();
      right += weight[i] * d * (1.0 / p.depth - inverse);
    }
    const Eigen::LDLT<Mat2> solver(normal);
    const double smallest = solver.vectorD().minCoeff(), largest = solver.vectorD().maxCoeff();
    if (!(smallest > 1e-3 * largest)) return std::nullopt;  // all on a line
    slope = solver.solve(right);
    double square = 0.0, all = 0.0;
    for (int i = 0; i < kPlanePoints; ++i) {
      const Point& p = *near[static_cast<std::size_t>(i)].second;
      const double left = 1.0 / p.depth - inverse - slope.dot(p.ray - centre.ray);
      const double off = left * centre.depth / kPlaneShare;
      square += weight[i] * left * left;
      all += weight[i];
      weight[i] = 1.0 / (1.0 + off * off);
    }
    slope_sigma = std::sqrt(0.5 * solver.solve(Mat2::Identity()).trace() * square * kPlanePoints /
                            (all * (kPlanePoints - 2.0)));
  }
  return InverseDepthPlane{{slope.x(), slope.y(), inverse - slope.dot(centre.ray)}, slope_sigma};
}

// A whole-pixel square around a point and the point's place in it; false when it leaves the image.
bool cut(const cv::Mat& image, const Vec2& pixel, int half, cv::Mat& square, Vec2& place) {
  const int x = static_cast<int>(std::floor(pixel.x())) - half,
            y = static_cast<int>(std::floor(pixel.y())) - half, side = 2 * half + 1;
  if (x < 0 || y < 0 || x + side > image.cols || y + side > image.rows) return false;
  square = image(cv::Rect(x, y, side, side)).clone();
  place = pixel - Vec2(x, y);
  return true;
}

// d (x/z, y/z) / d pixel of what lies at `depth`, at the frame's time.
Mat2 ray_derivative(const RollingShutter& shutter, const Vec2& pixel, double depth,
                    const CameraMotion& motion) {
  const Lens& lens = shutter.lens();
  Mat2 derivative = Vec2(1.0 / lens.fx, 1.0 / lens.fy).asDiagonal();
  if (!shutter.rolling()) return derivative;
  for (int axis = 0; axis < 2; ++axis) {
    const Vec2 step = Vec2::Unit(axis);
    const auto ahead = ray_of(shutter.projector(), pixel + step),
               behind = ray_of(shutter.projector(), pixel - step);
    if (!ahead || !behind) continue;
    derivative.col(axis) = 0.5 * (shutter.ray_at_frame_time(*ahead, depth, motion) -
                                  shutter.ray_at_frame_time(*behind, depth, motion));
  }
  return derivative;
}

// Of one key frame: the patches anchored in it.
std::vector<WallPatch> patches_of(const PatchImage& image, const PointRefiner& refiner,
                                  const RollingShutter& shutter, const CameraMotion& motion,
                                  const Structure& structure, int keyframe,
                                  const std::vector<Point>& points,
                                  const std::vector<char>& anchored) {
  std::vector<WallPatch> patches;
  const Rigid3 world_from_cam = structure.cam_from_world[keyframe].inverse();
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!anchored[i]) continue;
    const Point& p = points[i];
    const auto found = inverse_depth_plane(p, points);
    if (!found) continue;
    const Vec3& plane = found->plane;
    const Vec3 ray(p.ray.x(), p.ray.y(), 1.0);
    const Vec3 normal = plane.normalized();  // away from the camera: plane . X = 1
    if (!(normal.dot(ray.normalized()) >= kMinIncidence)) continue;
    WallPatch patch;
    patch.track = p.track;
    patch.anchor = keyframe;
    patch.anchor_px = p.pixel;
    patch.centre = structure.tracks[static_cast<std::size_t>(p.track)].point;
    patch.normal = -(world_from_cam.rotation * normal);
    patch.normal_sigma_rad = found->slope_sigma / plane.norm();
    // X = ray / (plane . ray), so dX/dx = z e_x - z^2 a ray for the ray's x.
    const double z = p.depth;
    const Vec3 along_ray_x =
                   world_from_cam.rotation * (z * Vec3::UnitX() - z * z * plane.x() * ray),
               along_ray_y =
                   world_from_cam.rotation * (z * Vec3::UnitY() - z * z * plane.y() * ray);
    const Mat2 rays = ray_derivative(shutter, p.pixel, z, motion);
    patch.along_x = along_ray_x * rays(0, 0) + along_ray_y * rays(1, 0);
    patch.along_y = along_ray_x * rays(0, 1) + along_ray_y * rays(1, 1);
    auto fine = refiner.make_template(image.fine, p.pixel / image.fine_shrink);
    if (!fine) continue;
    patch.fine = std::move(*fine);
    if (!cut(image.coarse, p.pixel / image.coarse_shrink, kCoarseHalfPx, patch.coarse,
             patch.coarse_px))
      patch.coarse.release();  // near the border: followed, but not looked for
    patches.push_back(std::move(patch));
  }
  return patches;
}

}  // namespace

PatchImage prepare_patch_image(const Frame& frame) {
  PatchImage image;
  const auto shrink_to = [&](int width_px) {
    return std::max(1.0, frame.gray.cols / static_cast<double>(width_px));
  };
  const auto shrunk = [](const cv::Mat& picture, double shrink) {
    if (shrink == 1.0) return picture;
    cv::Mat small;
    cv::resize(picture, small,
               {static_cast<int>(std::lround(picture.cols / shrink)),
                static_cast<int>(std::lround(picture.rows / shrink))},
               0, 0, cv::INTER_AREA);
    return small;
  };
  image.fine_shrink = shrink_to(kFineWidthPx);
  shrunk(frame.gray, image.fine_shrink).convertTo(image.fine, CV_32F, 1.0 / 255.0);
  if (frame.gray.cols < kNarrowPx) cv::GaussianBlur(image.fine, image.fine, {}, kSmoothingPx);
  image.coarse_shrink = shrink_to(kCoarseWidthPx);
  const cv::Mat small = shrunk(frame.gray, image.coarse_shrink),
                valid = shrunk(frame.valid, image.coarse_shrink);
  image.coarse = even_light(small, valid == 255);
  image.usable = frame.valid & ~frame.reflection;
  return image;
}

PointRefinementOptions patch_refinement(const Lens& lens) {
  const double scale = std::min(lens.width, kFineWidthPx) / kReferenceWidthPx;
  PointRefinementOptions options;
  options.radius_px = std::max(kLeastRadiusPx, kRadiusPx * scale);
  options.max_motion_px = std::max(kLeastMotionPx, kMaxMotionPx * scale);
  options.min_correlation = kMinCorrelation;
  return options;
}

std::optional<PatchSight> foretell(const WallPatch& patch, const MovingPose& camera,
                                   const RollingShutter& shutter) {
  const Rigid3& cam_from_world = camera.cam_from_world;
  const Vec3 p_cam = cam_from_world * patch.centre;
  if (!(p_cam.z() > 0.0)) return std::nullopt;
  const Vec3 normal_cam = cam_from_world.rotation * patch.normal;
  if (!(-normal_cam.dot(p_cam.normalized()) >= kMinIncidence)) return std::nullopt;
  const auto pixel = shutter.project(p_cam, camera.motion);
  if (!pixel || !shutter.lens().contains(*pixel)) return std::nullopt;
  PatchSight sight{*pixel, Mat2::Zero()};
  const Vec3 x_cam = cam_from_world.rotation * patch.along_x,
             y_cam = cam_from_world.rotation * patch.along_y;
  for (int axis = 0; axis < 2; ++axis) {
    const Vec3& step = axis == 0 ? x_cam : y_cam;
    const auto ahead = shutter.project(p_cam + step, camera.motion),
               behind = shutter.project(p_cam - step, camera.motion);
    if (!ahead || !behind) return std::nullopt;
    sight.linear.col(axis) = 0.5 * (*ahead - *behind);
  }
  const Vec2 scales = Eigen::JacobiSVD<Mat2>(sight.linear).singularValues();
  if (!(scales[1] >= kMinScale && scales[0] <= kMaxScale)) return std::nullopt;
  return sight;
}

std::vector<WallPatch> make_patches(const FrameSource& frames, const Structure& structure) {
  const std::size_t n = structure.frames.size();
  std::vector<std::vector<Point>> points(n);
  std::vector<std::vector<char>> anchored(n);
  for (std::size_t t = 0; t < structure.tracks.size(); ++t) {
    const Track& track = structure.tracks[t];
    if (!track.triangulated || track.observations.empty()) continue;
    const std::size_t middle = track.observations.size() / 2;
    for (std::size_t i = 0; i < track.observations.size(); ++i) {
      const Track::Observation& o = track.observations[i];
      const double depth = (structure.cam_from_world[o.keyframe] * track.point).z();
      points[o.keyframe].push_back({static_cast<int>(t), o.pixel, o.ray, depth});
      anchored[o.keyframe].push_back(i == middle);
    }
  }
  const std::vector<CameraMotion> motions = keyframe_motions(frames, structure);
  const PointRefiner refiner(patch_refinement(frames.lens()));
  std::vector<std::vector<WallPatch>> found(n);
  for (std::size_t begin = 0; begin < n; begin += kAtOnce) {
    tbb::parallel_for(begin, std::min(n, begin + kAtOnce), [&](std::size_t k) {
      if (!structure.placed[k] || points[k].empty()) return;
      const PatchImage image = prepare_patch_image(frames.pose_frame(structure.frames[k]));
      found[k] = patches_of(image, refiner, frames.shutter(), motions[k], structure,
                            static_cast<int>(k), points[k], anchored[k]);
    });
  }
  std::vector<WallPatch> patches;
  for (std::vector<WallPatch>& of_frame : found)
    std::move(of_frame.begin(), of_frame.end(), std::back_inserter(patches));
  return patches;
}

}  // namespace rugae
