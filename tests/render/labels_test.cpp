#include "render/labels.h"

#include <gtest/gtest.h>

#include "render/frame.h"
#include "tests/render/moving_world.h"

namespace rugae {
namespace {

using test::lambert;
using test::project_again;
using test::small_camera;

FrameRenderer renderer_of(const TriangleMesh& wall, const Camera& camera) {
  return {Surface(wall, test::constant_material(lambert(0.5f))), camera, {}};
}

unsigned char mask_at(const FrameTruth& truth, int x, int y) {
  return truth.masks.ptr<unsigned char>(y)[x];
}

constexpr double kExact_mm = 1e-4;

TEST(Labels, DepthAndNormalOfAPlane) {
  const Camera camera = small_camera();
  // A plane through n . p = 20 in the world, seen by a turned and moved camera.
  const TriangleMesh wall = test::plane_mesh(20.0, 2000.0, 3);
  const Rigid3 pose(Quat(Eigen::AngleAxisd(0.3, Vec3(0.0, 0.6, 0.8))), Vec3(3.0, -2.0, 1.0));
  const FrameTruth truth = renderer_of(wall, camera).render(pose, nullptr).truth;
  EXPECT_TRUE(truth.flow_px.empty());
  for (int y = 0; y < camera.lens.height; ++y)
    for (int x = 0; x < camera.lens.width; ++x) {
      const Vec3 ray = *camera.lens.unproject({x + 0.5, y + 0.5});
      const Vec3 ray_world = pose.rotation * ray;
      const double range_mm = (20.0 - 1.0) / ray_world.z();
      ASSERT_EQ(mask_at(truth, x, y) & kMaskValid, kMaskValid);
      ASSERT_NEAR(truth.depth_mm.ptr<float>(y)[x], range_mm * ray.z(), kExact_mm);
      const Vec3 facing = pose.rotation.conjugate() * Vec3(0.0, 0.0, -1.0);
      ASSERT_TRUE((truth.normal.ptr<Vec3f>(y)[x].cast<double>() - facing).norm() <= 1e-6);
    }
}

TEST(Labels, DepthAndNormalOfASphere) {
  const Camera camera = small_camera();
  // Facets of seven levels lie at most 1.7e-5 of the radius inside: 8e-5 mm.
  constexpr double kRadius_mm = 5.0;
  const TriangleMesh wall = test::sphere_mesh(7, kRadius_mm);
  const ClosestPoint closest(wall);
  const Rigid3 pose(test::random_rotation(3), Vec3(0.9, -0.5, 0.4));
  const FrameTruth truth = renderer_of(wall, camera).render(pose, nullptr).truth;
  for (int y = 0; y < camera.lens.height; ++y)
    for (int x = 0; x < camera.lens.width; ++x) {
      const Vec3 ray = *camera.lens.unproject({x + 0.5, y + 0.5});
      const Vec3 d = pose.rotation * ray, o = pose.translation;
      const double b = o.dot(d);
      const double range_mm = -b + std::sqrt(b * b - o.squaredNorm() + kRadius_mm * kRadius_mm);
      ASSERT_NEAR(truth.depth_mm.ptr<float>(y)[x], range_mm * ray.z(), kExact_mm);
      // Facing the camera, within a facet's size of the sphere's normal.
      const Vec3 normal = pose.rotation * truth.normal.ptr<Vec3f>(y)[x].cast<double>();
      const Vec3 point = o + range_mm * d;
      ASSERT_NEAR(normal.norm(), 1.0, 1e-6);
      ASSERT_TRUE(normal.dot(-point / kRadius_mm) > std::cos(0.01));
      // ... and the facet's own normal.
      const Vec3 facet = triangle_normal(wall, closest(point).triangle);
      if (closest(point).barycentric.minCoeff() > 0.05) {
        ASSERT_TRUE((normal + facet).norm() < 1e-4);
      }
    }
}

TEST(Labels, SurfacePointsLandOnTheMesh) {
  const Camera camera = small_camera();
  const TriangleMesh wall = test::folded_mesh(5);
  const ClosestPoint closest(wall);
  const Rigid3 pose(test::random_rotation(5), Vec3(3.0, 2.0, -4.0));
  const FrameTruth truth = renderer_of(wall, camera).render(pose, nullptr).truth;
  for (int y = 0; y < camera.lens.height; y += 2)
    for (int x = 0; x < camera.lens.width; x += 2) {
      const Vec3 ray = *camera.lens.unproject({x + 0.5, y + 0.5});
      const Vec3 point = pose * (truth.depth_mm.ptr<float>(y)[x] / ray.z() * ray);
      ASSERT_TRUE(closest(point).distance_mm <= kExact_mm) << x << " " << y;
    }
}

struct Pair {
  Camera camera = small_camera();
  TriangleMesh wall = test::folded_mesh(4);
  Rigid3 pose{test::random_rotation(11), Vec3(3.0, 2.0, -4.0)};
  Rigid3 next{pose.rotation * Quat(Eigen::AngleAxisd(0.15, Vec3(0.0, 0.6, 0.8))),
              Vec3(-9.0, 9.0, 1.0)};
  FrameTruth truth = renderer_of(wall, camera).render(pose, &next).truth;

  Vec3 point_world(int x, int y) const {
    const Vec3 ray = *camera.lens.unproject({x + 0.5, y + 0.5});
    return pose * (truth.depth_mm.ptr<float>(y)[x] / ray.z() * ray);
  }
};

TEST(Labels, FlowAgreesWithReprojection) {
  const Pair p;
  int valid = 0;
  for (int y = 0; y < p.camera.lens.height; ++y)
    for (int x = 0; x < p.camera.lens.width; ++x) {
      const Vec3 in_next = p.next.inverse() * p.point_world(x, y);
      const Vec2f flow = p.truth.flow_px.ptr<Vec2f>(y)[x];
      const bool in_front = in_next.z() > 0.2 * in_next.norm();
      const Vec2 landing = in_front ? project_again(p.camera.lens, in_next) : Vec2(-1.0, -1.0);
      const bool lands = in_front && p.camera.lens.contains(landing);
      const bool said = mask_at(p.truth, x, y) & kMaskFlowValid;
      ASSERT_EQ(said, std::isfinite(flow.x()));
      // Points that land on the very border may fall either way.
      const double margin = std::min({landing.x(), landing.y(), p.camera.lens.width - landing.x(),
                                      p.camera.lens.height - landing.y()});
      if (std::abs(margin) > 1e-3) {
        ASSERT_EQ(said, lands) << x << " " << y;
      }
      if (!said) continue;
      ++valid;
      ASSERT_TRUE((flow.cast<double>() - (landing - Vec2(x + 0.5, y + 0.5))).norm() <= 0.01);
    }
  EXPECT_GT(valid, 1000);
}

TEST(Labels, OcclusionAgreesWithTryingEveryTriangle) {
  const Pair p;
  int valid = 0, occluded = 0, compared = 0;
  for (int y = 0; y < p.camera.lens.height; y += 2)
    for (int x = 0; x < p.camera.lens.width; x += 2) {
      const unsigned char mask = mask_at(p.truth, x, y);
      if (!(mask & kMaskFlowValid)) {
        ASSERT_FALSE(mask & kMaskFlowOccluded);
        continue;
      }
      ++valid;
      const Vec3 to = p.point_world(x, y) - p.next.translation;
      const auto nearest = test::brute_force(p.wall, p.next.translation, to.normalized());
      ASSERT_TRUE(nearest);
      const double short_of_mm = to.norm() - nearest->range_mm;
      // Within the label's own resolution of an outline either answer is right.
      if (short_of_mm > 1e-3 && short_of_mm < 2e-3 * to.norm()) continue;
      ++compared;
      ASSERT_EQ((mask & kMaskFlowOccluded) != 0, short_of_mm > 1e-3) << x << " " << y;
      occluded += (mask & kMaskFlowOccluded) != 0;
    }
  EXPECT_GT(occluded, 30);
  EXPECT_GT(valid - occluded, 100);
  EXPECT_GT(compared, valid * 95 / 100);
}

// A camera that does not move: no flow, nothing hidden.
TEST(Labels, StandingStill) {
  const Pair p;
  const FrameTruth truth = renderer_of(p.wall, p.camera).render(p.pose, &p.pose).truth;
  for (int y = 0; y < p.camera.lens.height; ++y)
    for (int x = 0; x < p.camera.lens.width; ++x) {
      ASSERT_EQ(mask_at(truth, x, y), kMaskValid | kMaskFlowValid) << x << " " << y;
      ASSERT_TRUE(truth.flow_px.ptr<Vec2f>(y)[x].norm() < 1e-6);
    }
}

TEST(Labels, NothingWhereNothingIsMet) {
  const Camera camera = small_camera();
  const TriangleMesh wall = test::plane_mesh(20.0, 3.0, 2);
  const Rigid3 pose;
  const FrameTruth truth = renderer_of(wall, camera).render(pose, &pose).truth;
  EXPECT_EQ(mask_at(truth, 1, 1), 0);
  EXPECT_TRUE(std::isnan(truth.depth_mm.ptr<float>(1)[1]));
  EXPECT_TRUE(std::isnan(truth.normal.ptr<Vec3f>(1)[1].z()));
  EXPECT_TRUE(std::isnan(truth.flow_px.ptr<Vec2f>(1)[1].y()));
}

}  // namespace
}  // namespace rugae
