// Against what the simulator says: flow labels at the pixels, tracks between them and over several
// frames, on a wall that moves and before a rolling shutter.
#include "studies/true_motion.h"

#include <gtest/gtest.h>

#include <map>
#include <opencv2/core.hpp>

#include "core/check.h"
#include "core/files.h"
#include "render/simulate.h"
#include "tests/studies/in_temporary_folder.h"

namespace rugae {
namespace {

constexpr int kWidth = 96, kHeight = 72, kFrames = 5;
// Flow labels and the tracks' barycentric coordinates are single precision.
constexpr double kLabels_px = 1e-4, kTracks_px = 1e-3;
// Nearer to the picture's border a landing may fall to either side.
constexpr double kBorder_px = 1e-3;

class TrueMotionTest : public InTemporaryFolder {
 protected:
  void simulate_with(const std::string& scene, const std::string& shutter) {
    write_atomic(
        folder_ / "camera.yaml",
        fmt::format(
            "name: small\ndiameter_mm: 5\n"
            "lens: {{width: {}, height: {}, horizontal_fov_deg: 100, k1: -0.15, k2: 0.02}}\n"
            "sensor: {{pixel_pitch_um: 6, fps: 30, bit_depth: 10, full_well_e: 18000, "
            "read_noise_e: 10, {}}}\n",
            kWidth, kHeight, shutter));
    // High folds and an oblique look, so that some wall is hidden.
    write_atomic(folder_ / "scene.yaml", fmt::format("like: {}\nrelief: {{rugae_height_mm: 7, "
                                                     "rugae_spacing_mm: 14}}\n",
                                                     scene));
    write_atomic(folder_ / "path.yaml",
                 "like: '1'\nlength_cm: 4\npasses: 1\noffset_share: 0.7\nview: {tilt_deg: 40}\n");
    SimulateOptions options;
    options.scene = (folder_ / "scene.yaml").string();
    options.camera = (folder_ / "camera.yaml").string();
    options.trajectory = (folder_ / "path.yaml").string();
    options.resolution = "coarse";
    options.frames = kFrames;
    options.render.truth.tracks = 2000;
    Progress progress(Progress::Output::silent);
    simulate(options, folder_ / "data", progress);
  }

  static bool near_border(const Vec2& px) {
    return px.minCoeff() < kBorder_px || px.x() > kWidth - kBorder_px ||
           px.y() > kHeight - kBorder_px;
  }

  void expect_the_labels() {
    const TrueMotion motion(folder_ / "data");
    std::vector<Vec2> pixels;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) pixels.emplace_back(x + 0.5, y + 0.5);
    std::map<TrueLanding::Sight, int> counts;
    for (int i = 0; i + 1 < kFrames; ++i) {
      const cv::Mat flow = motion.truth().flow_px(i), masks = motion.truth().masks(i);
      const std::vector<TrueLanding> found = motion.follow(i, i + 1, pixels);
      for (std::size_t k = 0; k < pixels.size(); ++k) {
        const unsigned char bits = masks.ptr<unsigned char>()[k];
        const auto said = !(bits & kMaskValid)       ? TrueLanding::Sight::nowhere
                          : !(bits & kMaskFlowValid) ? TrueLanding::Sight::outside
                          : bits & kMaskFlowOccluded ? TrueLanding::Sight::hidden
                                                     : TrueLanding::Sight::seen;
        ++counts[said];
        if (found[k].sight != TrueLanding::Sight::nowhere && near_border(found[k].pixel)) continue;
        // The labels do not tell beyond the picture from beyond what the lens can see.
        if (said == TrueLanding::Sight::outside && found[k].sight == TrueLanding::Sight::nowhere)
          continue;
        ASSERT_EQ(static_cast<int>(found[k].sight), static_cast<int>(said)) << i << ": " << k;
        if (!(bits & kMaskFlowValid)) continue;
        const auto f = flow.ptr<cv::Vec2f>()[k];
        ASSERT_TRUE((pixels[k] + Vec2(f[0], f[1]) - found[k].pixel).norm() <= kLabels_px);
      }
    }
    EXPECT_TRUE(counts[TrueLanding::Sight::seen] > 10000 &&
                counts[TrueLanding::Sight::hidden] > 5 && counts[TrueLanding::Sight::outside] > 100)
        << counts[TrueLanding::Sight::seen] << " " << counts[TrueLanding::Sight::hidden] << " "
        << counts[TrueLanding::Sight::outside];
  }

  // Tracks lie between the pixels. Those that are hidden in the first frame are not what it sees.
  void expect_the_tracks() {
    const TrueMotion motion(folder_ / "data");
    int seen = 0, hidden = 0;
    for (int i = 0; i < kFrames; ++i)
      for (const int step : {1, 2, 4})
        if (i + step < kFrames) expect_the_tracks(motion, i, step, seen, hidden);
    EXPECT_TRUE(seen > 5000 && hidden > 5) << seen << " " << hidden;
  }
  static void expect_the_tracks(const TrueMotion& motion, int i, int step, int& seen, int& hidden) {
    std::map<int, TrackSample> there;
    for (const TrackSample& t : motion.truth().tracks(i + step)) there[t.point] = t;
    std::vector<Vec2> pixels;
    std::vector<int> points;
    for (const TrackSample& t : motion.truth().tracks(i))
      if (t.visible) {
        pixels.push_back(t.pixel);
        points.push_back(t.point);
      }
    const std::vector<TrueLanding> found = motion.follow(i, i + step, pixels);
    for (std::size_t k = 0; k < points.size(); ++k) {
      const auto t = there.find(points[k]);
      if (t == there.end() || near_border(t->second.pixel)) continue;
      ASSERT_TRUE((found[k].pixel - t->second.pixel).norm() <= kTracks_px)
          << i << " " << points[k] << ": " << found[k].pixel.transpose() << ", expected "
          << t->second.pixel.transpose();
      ASSERT_EQ(found[k].sight == TrueLanding::Sight::seen, t->second.visible)
          << i << " " << points[k];
      ++(t->second.visible ? seen : hidden);
    }
  }
};

TEST_F(TrueMotionTest, IsThatOfLabelsAndTracks) {
  simulate_with("stomach", "shutter: global");
  expect_the_labels();
  expect_the_tracks();

  const TrueMotion motion(folder_ / "data");
  const std::vector<Vec2> pixels{{1e6, -1e6}, {40.2, 30.7}};
  const std::vector<TrueLanding> found = motion.follow(2, 2, pixels);
  EXPECT_EQ(found[0].sight, TrueLanding::Sight::nowhere);  // beyond the lens
  EXPECT_EQ(found[1].sight, TrueLanding::Sight::seen);
  EXPECT_TRUE((found[1].pixel - pixels[1]).norm() <= 1e-9);  // to the same frame: stays
  EXPECT_THROW(motion.follow(0, kFrames, pixels), Error);
  EXPECT_THROW(motion.follow(-1, 0, pixels), Error);
}

TEST_F(TrueMotionTest, OfAMovingWallRowByRow) {
  simulate_with("stomach-moving", "shutter: rolling, row_time_us: 420");
  expect_the_labels();
  expect_the_tracks();
}

}  // namespace
}  // namespace rugae
