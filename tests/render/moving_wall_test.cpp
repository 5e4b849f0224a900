// Labels on a wall that moves, through a distorting lens and a rolling shutter.
#include <gtest/gtest.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <cstring>

#include "render/frame.h"
#include "tests/render/moving_world.h"

namespace rugae {
namespace {

using test::MovingWorld;

constexpr LabelSet kAll{.backward_flow = true, .triangles = true};

class Sequence {
 public:
  explicit Sequence(const MovingWorld& world)
      : world_(world), renderer_(world.renderer(kAll)), motion_(world.motion(renderer_)) {}
  CleanFrame frame(int index) const {
    const FrameView now = motion_.view(index);
    std::optional<FrameView> previous, next;
    if (index > 0) previous = motion_.view(index - 1);
    if (index + 1 < world_.frames) next = motion_.view(index + 1);
    return renderer_.render(now, previous ? &*previous : nullptr, next ? &*next : nullptr);
  }
  const SceneMotion& motion() const { return motion_; }

 private:
  const MovingWorld& world_;
  FrameRenderer renderer_;
  SceneMotion motion_;
};

// Depth, triangle and barycentric coordinates say where the pixel's own point is: it projects to
// the pixel at the time of its row. 1e-4 px: labels are float.
TEST(MovingWall, ThePointOfAPixelLiesOnItsRay) {
  const MovingWorld world(64, 48, 4, 0.9);
  const Sequence sequence(world);
  const FrameTruth truth = sequence.frame(5).truth;
  for (int y = 0; y < 48; ++y) {
    const double frame = 5 + world.offset_s(y + 0.5) * MovingWorld::kFps;
    const std::vector<Vec3> wall = world.wall_at(frame);
    const Rigid3 pose = world.pose(frame);
    for (int x = 0; x < 64; ++x) {
      const Vec3f label = truth.triangle.ptr<Vec3f>(y)[x];
      ASSERT_TRUE(label[0] >= 0.0f);
      const Vec3i t = world.triangle(label);
      const Vec3 p_cam = pose.inverse() * MovingWorld::on_triangle(wall, t, label);
      const Vec2 pixel = test::project_again(world.camera.lens, p_cam);
      ASSERT_TRUE((pixel - Vec2(x + 0.5, y + 0.5)).norm() <= 1e-4) << x << " " << y;
      ASSERT_NEAR(truth.depth_mm.ptr<float>(y)[x], p_cam.z(), 2e-5);
      const Vec3 cross = (wall[t[1]] - wall[t[0]]).cross(wall[t[2]] - wall[t[0]]).normalized();
      const Vec3 normal = truth.normal.ptr<Vec3f>(y)[x].cast<double>();
      ASSERT_TRUE(1.0 - std::abs(normal.dot(pose.rotation.conjugate() * cross)) <= 1e-6);
      ASSERT_TRUE(normal.dot(p_cam) < 0.0);
    }
  }
}

// Every pixel of several frames, both directions; also that no flow is missing.
TEST(MovingWall, FlowLandsWhereThePointGoes) {
  const MovingWorld world(64, 48, 4, 0.9);
  const Sequence sequence(world);
  constexpr double kLands_px = 0.01;
  constexpr double kBorder_px = 0.01;  // nearer to the border a landing may fall to either side
  for (const int index : {1, 4, 7}) {
    const FrameTruth truth = sequence.frame(index).truth;
    for (const int step : {1, -1}) {
      const cv::Mat& flow = step > 0 ? truth.flow_px : truth.backward_flow_px;
      const unsigned char bit = step > 0 ? kMaskFlowValid : kMaskBackwardFlowValid;
      std::atomic<int> valid = 0, wrong = 0;
      tbb::parallel_for(0, 48, [&](int y) {
        for (int x = 0; x < 64; ++x) {
          const auto landing = world.follow(truth.triangle.ptr<Vec3f>(y)[x], index + step);
          const bool said = truth.masks.ptr<unsigned char>(y)[x] & bit;
          const Vec2f f = flow.ptr<Vec2f>(y)[x];
          if (said != std::isfinite(f.x())) ++wrong;
          if (said) {
            ++valid;
            const bool lands =
                landing &&
                (Vec2(x + 0.5, y + 0.5) + f.cast<double>() - landing->pixel).norm() <= kLands_px;
            if (!lands) ++wrong;
          } else if (landing) {
            const Vec2& p = landing->pixel;
            const double inside = std::min({p.x(), p.y(), 64.0 - p.x(), 48.0 - p.y()});
            if (inside > kBorder_px) ++wrong;
          }
        }
      });
      EXPECT_EQ(wrong, 0) << index << " " << step;
      EXPECT_GT(valid, 2000) << index << " " << step;
    }
  }
}

// Every pixel of ten frames, both directions, against every triangle where it is at the time.
TEST(MovingWall, OcclusionAgreesWithTryingEveryTriangle) {
  const MovingWorld world(48, 36, 3, 0.9, 3.0);
  const Sequence sequence(world);
  int valid = 0, hidden = 0, wrong = 0;
  for (int index = 1; index <= 10; ++index) {
    const FrameTruth truth = sequence.frame(index).truth;
    for (const int step : {1, -1})
      for (int y = 0; y < 36; ++y)
        for (int x = 0; x < 48; ++x) {
          const unsigned char mask = truth.masks.ptr<unsigned char>(y)[x];
          const unsigned char lands = step > 0 ? kMaskFlowValid : kMaskBackwardFlowValid,
                              behind = step > 0 ? kMaskFlowOccluded : kMaskBackwardFlowOccluded;
          if (!(mask & lands)) {
            wrong += (mask & behind) != 0;
            continue;
          }
          const Vec3f label = truth.triangle.ptr<Vec3f>(y)[x];
          const Vec3i t = world.triangle(label);
          const auto landing = world.follow(label, index + step);
          ASSERT_TRUE(landing);
          const auto normal = [&](const std::vector<Vec3>& v) -> Vec3 {
            return (v[t[1]] - v[t[0]]).cross(v[t[2]] - v[t[0]]);
          };
          // The side seen now, by the label's normal; the same side at the landing.
          const double here = index + world.offset_s(y + 0.5) * MovingWorld::kFps;
          const Vec3 seen =
              world.pose(here).rotation * truth.normal.ptr<Vec3f>(y)[x].cast<double>();
          const double side = seen.dot(normal(world.wall_at(here))) > 0.0 ? 1.0 : -1.0;
          TriangleMesh wall;
          wall.vertices = world.wall_at(landing->frame);
          wall.triangles = world.rest.triangles;
          const Vec3 to = landing->point - landing->eye;
          const bool faces = side * normal(wall.vertices).dot(to) < 0.0;
          const auto nearest = test::brute_force(wall, landing->eye, to.normalized());
          const bool met = nearest && nearest->range_mm < Raycaster::kReach * to.norm();
          ++valid;
          hidden += !faces || met;
          wrong += ((mask & behind) != 0) != (!faces || met);
        }
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(valid, 20000);
  EXPECT_GT(hidden, 300);
}

// Flow there and back: backward flow between pixels is bilinear, so pixels at outlines, where it
// jumps, are left out.
TEST(MovingWall, ForwardAndBackwardFlowCancel) {
  const MovingWorld world(128, 96, 5, 0.9, 0.5);
  const Sequence sequence(world);
  const FrameTruth now = sequence.frame(5).truth, next = sequence.frame(6).truth;
  constexpr double kCancel_px = 0.05;
  int compared = 0, visible = 0;
  for (int y = 0; y < 96; ++y)
    for (int x = 0; x < 128; ++x) {
      const unsigned char mask = now.masks.ptr<unsigned char>(y)[x];
      if (!(mask & kMaskFlowValid) || (mask & kMaskFlowOccluded)) continue;
      ++visible;
      const Vec2 flow = now.flow_px.ptr<Vec2f>(y)[x].cast<double>();
      const Vec2 at = Vec2(x, y) + flow;
      const int x0 = static_cast<int>(std::floor(at.x())),
                y0 = static_cast<int>(std::floor(at.y()));
      if (x0 < 0 || y0 < 0 || x0 > 126 || y0 > 94) continue;
      bool smooth = true;
      Vec2 back = Vec2::Zero();
      float least = 1e9f, most = 0.0f;
      for (int k = 0; k < 4; ++k) {
        const int xk = x0 + k % 2, yk = y0 + k / 2;
        const unsigned char m = next.masks.ptr<unsigned char>(yk)[xk];
        smooth = smooth && (m & kMaskBackwardFlowValid) && !(m & kMaskBackwardFlowOccluded);
        least = std::min(least, next.depth_mm.ptr<float>(yk)[xk]);
        most = std::max(most, next.depth_mm.ptr<float>(yk)[xk]);
        const double weight = (k % 2 ? at.x() - x0 : 1.0 - (at.x() - x0)) *
                              (k / 2 ? at.y() - y0 : 1.0 - (at.y() - y0));
        back += weight * next.backward_flow_px.ptr<Vec2f>(yk)[xk].cast<double>();
      }
      constexpr float kOutline = 1.1f;
      if (!smooth || most > kOutline * least) continue;
      ++compared;
      ASSERT_TRUE((flow + back).norm() <= kCancel_px)
          << x << " " << y << " " << (flow + back).norm();
    }
  EXPECT_GT(compared, visible * 8 / 10);
  EXPECT_GT(visible, 6000);
}

TEST(MovingWall, OneAndTwoThreadsMakeTheSameFrames) {
  const MovingWorld world(64, 48, 4, 0.9);
  const auto render = [&](int threads) {
    tbb::task_arena arena(threads);
    return arena.execute([&] { return Sequence(world).frame(3); });
  };
  const CleanFrame one = render(1), two = render(2);
  const auto same = [](const cv::Mat& a, const cv::Mat& b) {
    return a.total() == b.total() && a.isContinuous() && b.isContinuous() &&
           std::memcmp(a.data, b.data, a.total() * a.elemSize()) == 0;
  };
  EXPECT_TRUE(same(one.radiance, two.radiance));
  EXPECT_TRUE(same(one.truth.depth_mm, two.truth.depth_mm));
  EXPECT_TRUE(same(one.truth.flow_px, two.truth.flow_px));
  EXPECT_TRUE(same(one.truth.backward_flow_px, two.truth.backward_flow_px));
  EXPECT_TRUE(same(one.truth.masks, two.truth.masks));
}

// A wall that is said to move and does not is the wall that keeps still, whatever hierarchy is
// traced.
TEST(MovingWall, AWallThatDoesNotMoveIsAStillOne) {
  MovingWorld world(64, 48, 4, 0.9);
  const FrameRenderer renderer = world.renderer(kAll);
  const auto path = [&](double frame) { return world.pose(frame); };
  const MotionOptions options{.frames = world.frames,
                              .fps = MovingWorld::kFps,
                              .height = 48,
                              .row_time_s = world.row_time_s()};
  const SceneMotion still(renderer.wall(), {}, path, options);
  const SceneMotion moving(
      renderer.wall(), [&](double, std::vector<Vec3>& v) { v = world.rest.vertices; }, path,
      options);
  const auto render = [&](const SceneMotion& motion) {
    const FrameView now = motion.view(4), next = motion.view(5);
    return renderer.render(now, nullptr, &next).truth;
  };
  const FrameTruth a = render(still), b = render(moving);
  for (int i = 0; i < 64 * 48; ++i) {
    ASSERT_EQ(a.depth_mm.ptr<float>()[i], b.depth_mm.ptr<float>()[i]);
    ASSERT_EQ(a.masks.ptr<unsigned char>()[i], b.masks.ptr<unsigned char>()[i]);
    if (a.masks.ptr<unsigned char>()[i] & kMaskFlowValid) {
      ASSERT_EQ(a.flow_px.ptr<Vec2f>()[i], b.flow_px.ptr<Vec2f>()[i]);
    }
  }
}

TEST(MovingWall, DisplacementsAreExactAndHoldAtTheEnds) {
  const MovingWorld world(16, 12, 2, 0.5);
  const FrameRenderer renderer = world.renderer({});
  const SceneMotion motion = world.motion(renderer);
  const Hit corner{0, 1.0, 0.0f, 0.0f};  // the first corner of the first triangle
  const auto vertex = static_cast<std::size_t>(world.rest.triangles[0][0]);
  for (const int frame : {0, 3, world.frames - 1}) {
    const auto wall = motion.view(frame).wall;
    const Vec3 exact =
        world.rest.vertices[vertex] + motion.displacement_mm(frame)[vertex].cast<double>();
    EXPECT_EQ(wall->point(corner, 0.0), exact);
    EXPECT_TRUE((exact - world.wall_at(frame)[vertex]).norm() <= SceneMotion::kDisplacementStep_mm);
  }
  const auto first = motion.view(0).wall, last = motion.view(world.frames - 1).wall;
  EXPECT_EQ(first->point(corner, -0.4), first->point(corner, 0.0));
  EXPECT_NE(first->point(corner, 0.4), first->point(corner, 0.0));
  EXPECT_EQ(last->point(corner, 0.4), last->point(corner, 0.0));
}

// A vertical edge seen by a camera that turns by w rad/s about the vertical: the row at v is
// exposed t = (v - h/2) row_time after the middle, so the edge lies at cx - fx tan(w t) in it.
TEST(RollingShutter, AVerticalEdgeBendsAsComputed) {
  Camera camera = test::small_camera(96, 72);
  camera.lens.k1 = camera.lens.k2 = camera.lens.p1 = camera.lens.p2 = 0.0;
  constexpr double kTurn_rad_per_frame = 0.3, kFps = 30.0;
  const double row_time_s = 0.95 / (kFps * 72);
  const Material edge = [](std::span<const MaterialQuery> queries, std::span<MucosaSample> out) {
    for (std::size_t i = 0; i < queries.size(); ++i)
      out[i] = test::lambert(queries[i].rest_position_mm.x() > 0.0f ? 0.8f : 0.0f);
  };
  const TriangleMesh wall = test::plane_mesh(20.0, 400.0, 2);
  const FrameRenderer renderer(Surface(wall, edge), camera,
                               {.vignetting = false, .labels = LabelSet::none()});
  const SceneMotion motion(
      renderer.wall(), {},
      [](double frame) {
        return Rigid3(Quat(Eigen::AngleAxisd(kTurn_rad_per_frame * (frame - 1.0), Vec3::UnitY())),
                      Vec3::Zero());
      },
      {.frames = 3, .fps = kFps, .height = 72, .row_time_s = row_time_s});
  const cv::Mat image = renderer.render(motion.view(1), nullptr, nullptr).radiance;
  double leftmost = 96.0, rightmost = 0.0;
  for (int y = 0; y < 72; ++y) {
    const double turned_rad = kTurn_rad_per_frame * kFps * (y - 35.5) * row_time_s;
    const double edge_px = camera.lens.cx - camera.lens.fx * std::tan(turned_rad);
    leftmost = std::min(leftmost, edge_px);
    rightmost = std::max(rightmost, edge_px);
    for (int x = 0; x < 96; ++x) {
      if (std::abs(x + 0.5 - edge_px) <= 1e-3) continue;
      ASSERT_EQ(image.ptr<Vec3f>(y)[x][0] > 0.0f, x + 0.5 > edge_px) << x << " " << y;
    }
  }
  EXPECT_GT(rightmost - leftmost, 10.0);
}

TEST(RollingShutter, RowPosesAreLinearBetweenRowsAndHoldBeyond) {
  std::vector<Rigid3> poses;
  for (int row = -1; row <= 4; ++row)
    poses.push_back({Quat(Eigen::AngleAxisd(0.01 * row, Vec3::UnitZ())), Vec3(row, 0.0, 0.0)});
  const RowPoses rows(poses, 1e-3);
  EXPECT_DOUBLE_EQ(rows.at(0.5).translation.x(), 0.0);
  EXPECT_DOUBLE_EQ(rows.at(2.25).translation.x(), 1.75);
  EXPECT_NEAR(
      rows.at(2.25).rotation.angularDistance(Quat(Eigen::AngleAxisd(0.0175, Vec3::UnitZ()))), 0.0,
      1e-7);
  EXPECT_DOUBLE_EQ(rows.at(-7.0).translation.x(), -1.0);
  EXPECT_DOUBLE_EQ(rows.at(70.0).translation.x(), 4.0);
  EXPECT_DOUBLE_EQ(rows.offset_s(2.0), 0.0);
  EXPECT_DOUBLE_EQ(rows.offset_s(3.0), 1e-3);
}

}  // namespace
}  // namespace rugae
