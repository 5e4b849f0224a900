#include "recon/map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/core.hpp>

#include "core/units.h"

namespace rugae {
namespace {

Lens test_lens() {
  Lens lens;
  lens.width = 160;
  lens.height = 120;
  lens.fx = lens.fy = 70.0;
  lens.cx = 80.0;
  lens.cy = 60.0;
  return lens;
}

/// 100 degrees both ways: six views cover all directions.
Lens wide_lens() {
  Lens lens;
  lens.width = lens.height = 120;
  lens.fx = lens.fy = 50.0;
  lens.cx = lens.cy = 60.0;
  return lens;
}

/// A wall: distance along a ray from a place, and its grey value.
struct Wall {
  std::function<double(const Vec3& origin, const Vec3& direction)> distance;
  std::function<uchar(const Vec3& p)> gray;
};

Wall plane(double z, double square) {
  return {[=](const Vec3& origin, const Vec3& direction) {
            return direction.z() > 0.0 ? (z - origin.z()) / direction.z() : -1.0;
          },
          [=](const Vec3& p) -> uchar {
            const int parity = static_cast<int>(std::floor(p.x() / square)) +
                               static_cast<int>(std::floor(p.y() / square));
            return parity % 2 == 0 ? 200 : 60;
          }};
}

Wall sphere(double radius) {
  return {[=](const Vec3& origin, const Vec3& direction) {
            const double b = origin.dot(direction);
            return -b + std::sqrt(b * b - origin.squaredNorm() + radius * radius);
          },
          [](const Vec3&) -> uchar { return 150; }};
}

struct Scene {
  std::vector<Mosaic> mosaics;
  Structure structure;
};

/// One mosaic a camera, as seen by it, and exact sparse points on a grid of pixels.
Scene observe(const Wall& wall, const std::vector<Rigid3>& cams_from_world, const Lens& lens,
              int point_grid_px) {
  Scene scene;
  for (std::size_t k = 0; k < cams_from_world.size(); ++k) {
    const Rigid3 world_from_cam = cams_from_world[k].inverse();
    Mosaic mosaic;
    mosaic.anchor = static_cast<int>(k);
    mosaic.members = {mosaic.anchor};
    mosaic.bgr = cv::Mat::zeros(lens.height, lens.width, CV_8UC3);
    mosaic.valid = cv::Mat(lens.height, lens.width, CV_8U, cv::Scalar(255));
    mosaic.seams = cv::Mat(lens.height, lens.width, CV_32S, cv::Scalar(mosaic.anchor));
    for (int y = 0; y < lens.height; ++y)
      for (int x = 0; x < lens.width; ++x) {
        const Vec2 pixel(x + 0.5, y + 0.5);
        const Vec3 direction = world_from_cam.rotation * lens.unproject(pixel).value();
        const double distance = wall.distance(world_from_cam.translation, direction);
        if (!(distance > 0.0)) {
          mosaic.valid.at<uchar>(y, x) = 0;
          continue;
        }
        const Vec3 p_world = world_from_cam.translation + distance * direction;
        mosaic.bgr.at<cv::Vec3b>(y, x) = cv::Vec3b::all(wall.gray(p_world));
        if (x % point_grid_px != 0 || y % point_grid_px != 0) continue;
        Track track;
        track.observations.push_back({mosaic.anchor, pixel});
        track.point = p_world;
        track.triangulated = true;
        scene.structure.tracks.push_back(track);
      }
    scene.mosaics.push_back(mosaic);
  }
  scene.structure.frames.resize(cams_from_world.size());
  scene.structure.placed.assign(cams_from_world.size(), true);
  scene.structure.cam_from_world = cams_from_world;
  return scene;
}

std::vector<std::optional<MosaicDepth>> place_all(const Scene& scene, const Lens& lens) {
  std::vector<std::optional<MosaicDepth>> depths;
  for (const Mosaic& mosaic : scene.mosaics)
    depths.push_back(place_mosaic(mosaic, scene.structure, lens, ShadingOptions{}));
  return depths;
}

TriangleMesh fuse(const Scene& scene, const std::vector<std::optional<MosaicDepth>>& depths,
                  const Lens& lens, const MapOptions& options = {}) {
  std::vector<DepthView> views;
  for (std::size_t i = 0; i < depths.size(); ++i)
    if (depths[i]) views.push_back(depth_view(scene.mosaics[i], *depths[i], scene.structure, lens));
  return fuse_views(std::move(views), options);
}

TriangleMesh map_of(const Scene& scene, const Lens& lens, const MapOptions& options = {}) {
  return fuse(scene, place_all(scene, lens), lens, options);
}

/// Six views from near the centre of a sphere cover all of it.
std::vector<Rigid3> six_views(const Vec3& place) {
  std::vector<Rigid3> views;
  for (int i = 0; i < 6; ++i) {
    const Vec3 axis = i < 4 ? Vec3::UnitY() : Vec3::UnitX();
    const double angle = i < 4 ? i * kPi / 2 : (i == 4 ? kPi / 2 : -kPi / 2);
    const Rigid3 world_from_cam(Quat(Eigen::AngleAxisd(angle, axis)), place);
    views.push_back(world_from_cam.inverse());
  }
  return views;
}

double rms(const std::vector<double>& values) {
  double square = 0.0;
  for (const double value : values) square += value * value;
  return std::sqrt(square / static_cast<double>(values.size()));
}

TEST(Map, DepthOfAPlaneIsThatOfItsPoints) {
  const Lens lens = test_lens();
  const Scene scene = observe(plane(50.0, 1e9), {Rigid3()}, lens, 6);
  const auto placed = place_mosaic(scene.mosaics[0], scene.structure, lens, ShadingOptions{});
  ASSERT_TRUE(placed);
  EXPECT_EQ(placed->rejected, 0);
  EXPECT_LE(placed->residual, 1e-3);
  for (int y = 10; y < 110; ++y)
    for (int x = 10; x < 150; ++x)
      ASSERT_TRUE(std::abs(placed->depth.at<float>(y, x) - 50.0f) <= 0.01f) << x << " " << y;
}

TEST(Map, DepthEndsWherePointsEnd) {
  const Lens lens = test_lens();
  Scene scene = observe(plane(50.0, 1e9), {Rigid3()}, lens, 4);
  // Points on the left half only.
  std::erase_if(scene.structure.tracks, [](const Track& t) { return t.point.x() > 0.0; });
  const auto placed = place_mosaic(scene.mosaics[0], scene.structure, lens, ShadingOptions{});
  ASSERT_TRUE(placed);
  EXPECT_TRUE(placed->depth.at<float>(60, 40) > 0.0f);
  EXPECT_TRUE(std::isnan(placed->depth.at<float>(60, 120)));
}

TEST(Map, FewPointsPlaceNothing) {
  const Lens lens = test_lens();
  const Scene scene = observe(plane(50.0, 1e9), {Rigid3()}, lens, 60);
  EXPECT_FALSE(place_mosaic(scene.mosaics[0], scene.structure, lens, ShadingOptions{}));
  EXPECT_TRUE(map_of(scene, lens).empty());
}

TEST(Map, PlaneIsFlatAndItsColoursLandWhereTheyBelong) {
  const Lens lens = test_lens();
  constexpr double kDepth = 50.0, kSquare = 15.0;
  const Wall wall = plane(kDepth, kSquare);
  const std::vector<Rigid3> views = {Rigid3(), Rigid3(Quat::Identity(), Vec3(-8.0, 3.0, 4.0))};
  const Scene scene = observe(wall, views, lens, 5);
  MapOptions options;
  options.voxel_share = 1.0 / 128.0;
  const TriangleMesh mesh = map_of(scene, lens, options);
  ASSERT_FALSE(mesh.empty());
  ASSERT_EQ(mesh.colors.size(), mesh.vertices.size());
  std::vector<double> errors;
  int right = 0, asked = 0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const Vec3& p = mesh.vertices[v];
    errors.push_back(p.z() - kDepth);
    // Away from the edges of squares, by two pixels of the picture (0.71 mm each).
    const auto from_edge = [&](double c) { return std::abs(std::remainder(c, kSquare)) > 1.5; };
    if (!from_edge(p.x()) || !from_edge(p.y())) continue;
    ++asked;
    right += std::abs(255.0f * mesh.colors[v][0] - wall.gray(p)) < 70.0f ? 1 : 0;
  }
  EXPECT_LE(rms(errors), 0.1);  // a seventh of a pixel's width on the wall
  EXPECT_GE(asked, 1000);
  EXPECT_GE(right, 0.98 * asked);
}

TEST(Map, InsideOfASphereComesBackRound) {
  const Lens lens = wide_lens();
  constexpr double kRadius = 30.0;
  const Scene scene = observe(sphere(kRadius), six_views(Vec3(2.0, -1.0, 3.0)), lens, 4);
  MapOptions options;
  options.voxel_share = 1.0 / 100.0;
  const TriangleMesh mesh = map_of(scene, lens, options);
  ASSERT_FALSE(mesh.empty());
  std::vector<double> errors;
  for (const Vec3& vertex : mesh.vertices) errors.push_back(vertex.norm() - kRadius);
  EXPECT_LE(rms(errors), 0.2);  // under 1 % of the radius; the voxel is 0.9
  // All of the sphere, wound outward.
  EXPECT_GE(area_mm2(mesh), 0.9 * 4 * kPi * kRadius * kRadius);
  EXPECT_NEAR(signed_volume_mm3(mesh), 4.0 / 3.0 * kPi * std::pow(kRadius, 3),
              0.1 * 4.0 / 3.0 * kPi * std::pow(kRadius, 3));
}

// A steep wall seen in a mosaic whose corner is not the anchor's: half a pixel of shift anywhere is
// half a pixel's width on the wall times the slope, 0.2 mm and more.
TEST(Map, SteepWallIsNotShiftedByHalfAPixel) {
  const Lens lens = test_lens();
  const Vec3 normal(-0.6, 0.3, 1.0);
  constexpr double kOffset = 50.0, kHalfOfTheShift = 0.1;
  const Wall wall = {[&](const Vec3& origin, const Vec3& direction) {
                       return (kOffset - normal.dot(origin)) / normal.dot(direction);
                     },
                     [](const Vec3&) -> uchar { return 150; }};
  Scene scene = observe(wall, {Rigid3()}, lens, 5);
  Mosaic& mosaic = scene.mosaics[0];
  const cv::Rect part(20, 15, 110, 80);
  mosaic.bgr = mosaic.bgr(part).clone();
  mosaic.valid = mosaic.valid(part).clone();
  mosaic.origin_px = Vec2(part.x, part.y);
  const auto depths = place_all(scene, lens);
  ASSERT_TRUE(depths[0]);
  double bias = 0.0;
  int count = 0;
  for (int y = 0; y < part.height; ++y)
    for (int x = 0; x < part.width; ++x) {
      const Vec3 ray = lens.unproject(Vec2(x + 0.5, y + 0.5) + mosaic.origin_px).value();
      const float z = depths[0]->depth.at<float>(y, x);
      if (!(z > 0.0f)) continue;
      bias += z - kOffset / normal.dot(ray) * ray.z();
      ++count;
    }
  ASSERT_GE(count, 8000);
  EXPECT_LE(std::abs(bias / count), kHalfOfTheShift);
  const TriangleMesh mesh = fuse(scene, depths, lens);
  ASSERT_FALSE(mesh.empty());
  double mesh_bias = 0.0;
  for (const Vec3& vertex : mesh.vertices) mesh_bias += normal.dot(vertex) - kOffset;
  EXPECT_LE(std::abs(mesh_bias / static_cast<double>(mesh.vertices.size())), kHalfOfTheShift);
}

TEST(Map, ScalingTheWorldScalesTheMapOnly) {
  const Lens lens = wide_lens();
  constexpr double kScale = 1024.0;  // a power of two: exact in floating point
  const Scene scene = observe(sphere(30.0), six_views(Vec3(2.0, -1.0, 3.0)), lens, 6);
  Scene large = scene;
  for (Track& track : large.structure.tracks) track.point *= kScale;
  for (Rigid3& pose : large.structure.cam_from_world) pose.translation *= kScale;
  MapOptions options;
  options.voxel_share = 1.0 / 64.0;
  const TriangleMesh a = map_of(scene, lens, options), b = map_of(large, lens, options);
  ASSERT_FALSE(a.empty());
  // Rounding may move a vertex across a voxel's corner: sizes agree to a thousandth.
  const auto count_a = static_cast<double>(a.vertices.size());
  EXPECT_NEAR(static_cast<double>(b.vertices.size()), count_a, 1e-3 * count_a);
  EXPECT_NEAR(area_mm2(b) / (kScale * kScale), area_mm2(a), 1e-3 * area_mm2(a));
  EXPECT_NEAR(signed_volume_mm3(b) / std::pow(kScale, 3), signed_volume_mm3(a),
              1e-3 * signed_volume_mm3(a));
}

TEST(Map, WrongPointsAreRejectedAndDoNotBendTheWall) {
  const Lens lens = test_lens();
  Scene scene = observe(plane(50.0, 1e9), {Rigid3()}, lens, 4);
  int wrong = 0;
  for (std::size_t i = 0; i < scene.structure.tracks.size(); i += 9, ++wrong)
    scene.structure.tracks[i].point *= 1.6;  // along the ray
  const auto placed = place_mosaic(scene.mosaics[0], scene.structure, lens, ShadingOptions{});
  ASSERT_TRUE(placed);
  EXPECT_EQ(placed->rejected, wrong);
  EXPECT_NEAR(placed->depth.at<float>(60, 80), 50.0, 0.1);
}

TEST(Map, TwoRunsGiveTheSameBytes) {
  const Lens lens = wide_lens();
  const Scene scene = observe(sphere(30.0), six_views(Vec3(2.0, -1.0, 3.0)), lens, 8);
  MapOptions options;
  options.voxel_share = 1.0 / 48.0;
  const TriangleMesh a = map_of(scene, lens, options), b = map_of(scene, lens, options);
  ASSERT_EQ(a.vertices.size(), b.vertices.size());
  for (std::size_t v = 0; v < a.vertices.size(); ++v) {
    ASSERT_TRUE(a.vertices[v] == b.vertices[v]);
    ASSERT_TRUE(a.colors[v] == b.colors[v]);
  }
  ASSERT_EQ(a.triangles.size(), b.triangles.size());
  for (std::size_t t = 0; t < a.triangles.size(); ++t)
    ASSERT_TRUE(a.triangles[t] == b.triangles[t]);
}

TEST(Map, FramesThatKeepTheirDistortionGiveTheSameSphere) {
  Lens lens = wide_lens();
  lens.k1 = -0.03;
  constexpr double kRadius = 30.0;
  const Scene scene = observe(sphere(kRadius), six_views(Vec3(2.0, -1.0, 3.0)), lens, 4);
  MapOptions options;
  options.voxel_share = 1.0 / 100.0;
  const TriangleMesh mesh = map_of(scene, lens, options);
  ASSERT_FALSE(mesh.empty());
  std::vector<double> errors;
  for (const Vec3& vertex : mesh.vertices) errors.push_back(vertex.norm() - kRadius);
  EXPECT_LE(rms(errors), 0.3);  // nearest-pixel resampling adds half a pixel of slope
}

// --- Depth of a key frame ----------------------------------------------------------------------

TEST(KeyframeDepth, TwoLargeTrianglesThroughADistortedLens) {
  Lens lens = test_lens();
  lens.k1 = -0.05;
  lens.p1 = 0.002;
  TriangleMesh wall;
  wall.vertices = {{-270, -90, 40}, {270, -90, 40}, {270, 270, 80}, {-270, 270, 80}};
  wall.triangles = {{0, 1, 2}, {0, 2, 3}};
  const Rigid3 cam_from_world(Quat(Eigen::AngleAxisd(0.2, Vec3::UnitY())), Vec3(1.0, 2.0, 3.0));
  const cv::Mat depth = keyframe_depth(wall, cam_from_world, lens);
  // The wall is the plane z = 50 + y / 9 of the world.
  const Vec3 normal = cam_from_world.rotation * Vec3(0.0, -1.0 / 9.0, 1.0);
  const double offset = normal.dot(cam_from_world * Vec3(0.0, 0.0, 50.0));
  for (int y = 0; y < lens.height; ++y)
    for (int x = 0; x < lens.width; ++x) {
      const Vec3 ray = lens.unproject({x + 0.5, y + 0.5}).value();
      const double expected = offset / normal.dot(ray) * ray.z();
      ASSERT_TRUE(std::abs(depth.at<float>(y, x) - expected) <= 1e-5 * expected)
          << x << " " << y << ": " << depth.at<float>(y, x) << " for " << expected;
    }
}

TEST(KeyframeDepth, ATriangleBesideTheEyeIsSeenNowhere) {
  // In front of the eye by less and less, and beyond all that the lens projects.
  for (const double z : {1e-3, 1e-6, 1e-8, 1e-10, 1e-12})
    for (const double side : {1.0, -1.0}) {
      TriangleMesh beside;
      beside.vertices = {{side, -100, z}, {side, 100, z}, {100 * side, 0, z}};
      beside.triangles = {{0, 1, 2}};
      TriangleMesh above = beside;
      for (Vec3& vertex : above.vertices) std::swap(vertex.x(), vertex.y());
      for (const TriangleMesh& wall : {beside, above}) {
        const cv::Mat depth = keyframe_depth(wall, Rigid3(), test_lens());
        EXPECT_EQ(cv::countNonZero(depth == depth), 0) << z << " " << side;
      }
    }
}

TEST(KeyframeDepth, TheNearerWallHidesTheFartherAndNothingIsUnknown) {
  const Lens lens = test_lens();
  TriangleMesh walls;
  walls.vertices = {{-200, -200, 60}, {200, -200, 60}, {0, 300, 60},
                    {-10, -10, 20},   {10, -10, 20},   {0, 15, 20}};
  walls.triangles = {{0, 1, 2}, {3, 4, 5}};
  for (const bool swapped : {false, true}) {
    if (swapped) std::swap(walls.triangles[0], walls.triangles[1]);
    const cv::Mat depth = keyframe_depth(walls, Rigid3(), lens);
    EXPECT_FLOAT_EQ(depth.at<float>(60, 80), 20.0f);
    EXPECT_FLOAT_EQ(depth.at<float>(5, 80), 60.0f);
  }
  const Rigid3 looking_away(Quat(Eigen::AngleAxisd(kPi, Vec3::UnitY())), Vec3::Zero());
  const cv::Mat away = keyframe_depth(walls, looking_away, lens);
  EXPECT_EQ(cv::countNonZero(away == away), 0);
  EXPECT_EQ(cv::countNonZero(keyframe_depth({}, Rigid3(), lens) > 0), 0);
}

}  // namespace
}  // namespace rugae
