// Depth maps of walls whose depth is known.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "dense_scene.h"

namespace rugae {
namespace {

using namespace testing;

constexpr double kDistance = 30.0, kBaseline = 4.0, kBrightAt = 26.0;
constexpr int kRim = 8;  // pixels at the border, where windows and sources are cut

struct Setting {
  DenseWall wall = plane_wall({0.3, -0.2, 1.0}, kDistance);
  double contrast = 0.3;
  double noise_levels = 0.0;
  double scale = 1.0;       // of the world
  double wrong_rad = 0.0;   // sources are believed to be turned by this
  double prior_off = 1.06;  // the prior over the true depth
  PinholeGrid grid = small_grid();
  DenseOptions options;
};

/// The reference at the origin and six sources around it, 4 mm off, which looks at a point 30 mm
/// away from 7.6 degrees off.
struct Scene {
  StereoView reference;
  std::vector<StereoView> views;
  cv::Mat truth;

  std::vector<const StereoView*> sources() const {
    std::vector<const StereoView*> pointers;
    for (const StereoView& view : views) pointers.push_back(&view);
    return pointers;
  }
};

Scene scene_of(const Setting& setting) {
  const PinholeGrid& grid = setting.grid;
  const Mottling mottling(3, setting.contrast, setting.scale);
  const auto view = [&](const Vec3& centre, std::uint32_t frame) {
    const Rigid3 cam_from_world = looking(setting.scale * centre, {0.01 * centre.x(), 0.0, 1.0});
    const WideFrame picture = draw_frame(
        setting.wall, [&](const Vec3& p) { return mottling(p); }, cam_from_world, grid,
        setting.scale * kBrightAt, setting.noise_levels, frame);
    return stereo_view(picture, cam_from_world, grid, setting.options);
  };
  Scene scene{view(Vec3::Zero(), 0), {}, true_depth(setting.wall, Rigid3{}, grid)};
  for (int i = 0; i < 6; ++i) {
    const double angle = kPi / 3.0 * i;
    scene.views.push_back(view(kBaseline * Vec3(std::cos(angle), std::sin(angle), 0.1),
                               static_cast<std::uint32_t>(i + 1)));
    const Rigid3 turn(Quat(Eigen::AngleAxisd(
                          setting.wrong_rad,
                          Vec3(std::sin(3.0 * angle + 1.0), std::cos(angle), 0.3).normalized())),
                      Vec3::Zero());
    scene.views.back().cam_from_world = turn * scene.views.back().cam_from_world;
  }
  return scene;
}

struct Stereo {
  DepthMap map;
  cv::Mat truth;
};

Stereo estimate(const Setting& setting) {
  const Scene scene = scene_of(setting);
  const DepthPrior prior{
      setting.prior_off * true_depth(setting.wall, Rigid3{}, scene.reference.levels.back().grid),
      0.2};
  return {estimate_depth(scene.reference, scene.sources(), prior, setting.options), scene.truth};
}

struct Errors {
  double known_share = 0.0;   // within the rim
  double median = 0.0;        // of |error| over depth
  double within_three = 0.0;  // share of errors within three sigma
  double median_sigma = 0.0;  // over depth
};

Errors errors_of(const Stereo& stereo) {
  std::vector<double> errors, sigmas;
  int pixels = 0, covered = 0;
  for (int y = kRim; y < stereo.truth.rows - kRim; ++y)
    for (int x = kRim; x < stereo.truth.cols - kRim; ++x) {
      ++pixels;
      const double z = stereo.map.depth.at<float>(y, x), truth = stereo.truth.at<float>(y, x);
      if (!(z > 0.0)) continue;
      const double sigma = stereo.map.sigma.at<float>(y, x);
      errors.push_back(std::abs(z - truth) / truth);
      sigmas.push_back(sigma / truth);
      covered += std::abs(z - truth) <= 3.0 * sigma ? 1 : 0;
    }
  if (errors.empty()) return {};
  std::ranges::sort(errors);
  std::ranges::sort(sigmas);
  const auto known = static_cast<double>(errors.size());
  return {known / pixels, errors[errors.size() / 2], covered / known, sigmas[sigmas.size() / 2]};
}

// A change of depth by its whole moves a source's picture by focal * baseline / distance = 80 * 4 /
// 30 = 10.7 px: a twentieth of a pixel is half a percent of depth. Without noise the match errs by
// less than that.
constexpr double kTwentiethOfAPixel = 0.005;

TEST(DenseDepth, SlantedPlane) {
  const Errors errors = errors_of(estimate({}));
  EXPECT_GE(errors.known_share, 0.95);
  EXPECT_LE(errors.median, 0.5 * kTwentiethOfAPixel);
  EXPECT_GE(errors.within_three, 0.99);
}

TEST(DenseDepth, InsideOfASphere) {
  Setting setting;
  setting.wall = sphere_wall(kDistance);
  const Errors errors = errors_of(estimate(setting));
  EXPECT_GE(errors.known_share, 0.95);
  EXPECT_LE(errors.median, 0.5 * kTwentiethOfAPixel);
  EXPECT_GE(errors.within_three, 0.99);
}

// The texture's standard deviation is 1.5 levels, the noise 1: a tenth of a pixel.
TEST(DenseDepth, SigmaCoversTheErrorOfNoise) {
  Setting setting;
  setting.contrast = 0.05;
  setting.noise_levels = 1.0;
  const Errors errors = errors_of(estimate(setting));
  EXPECT_GE(errors.known_share, 0.8);
  EXPECT_LE(errors.median, 2.0 * kTwentiethOfAPixel);
  EXPECT_GE(errors.within_three, 0.97);
  // And says something: the median of a normal distribution's absolute values is 0.67 sigma, which
  // is not missed by more than a factor of three.
  EXPECT_LE(errors.median_sigma, 3.0 * errors.median / 0.6745);
}

TEST(DenseDepth, MoreNoiseMeansMoreSigma) {
  Setting quiet, loud;
  quiet.contrast = loud.contrast = 0.05;
  quiet.noise_levels = 0.5;
  loud.noise_levels = 1.5;
  EXPECT_GE(errors_of(estimate(loud)).median_sigma, 1.5 * errors_of(estimate(quiet)).median_sigma);
}

// Some windows are alike by chance; that is for other depth maps to tell.
constexpr double kChance = 0.05;

TEST(DenseDepth, AWallWithoutTextureStaysUnknown) {
  Setting setting;
  setting.contrast = 0.0;
  setting.noise_levels = 1.0;
  EXPECT_LE(errors_of(estimate(setting)).known_share, kChance);
  setting.noise_levels = 0.0;
  EXPECT_LE(errors_of(estimate(setting)).known_share, kChance);
}

// Six degrees are 8 px: no window finds its like but by chance, of more places than above.
TEST(DenseDepth, WrongPosesFindLittle) {
  Setting setting;
  setting.wrong_rad = 6.0 * kPi / 180.0;
  EXPECT_LE(errors_of(estimate(setting)).known_share, 2.0 * kChance);
}

TEST(DenseDepth, AGapIsFoundFromASurfaceCloseByAndTheRestLeftAlone) {
  Setting setting;
  setting.contrast = 0.1;
  setting.noise_levels = 1.0;
  setting.grid = {320, 240, 160.0, 160.0, 160.0, 120.0};
  const Scene scene = scene_of(setting);
  const cv::Mat whole = estimate(setting).map.depth;
  const cv::Rect gap(80, 60, 160, 120);
  const auto again = [&](double off) {
    Stereo stereo = estimate(setting);
    stereo.map.depth(gap).setTo(std::nanf(""));
    stereo.map.sigma(gap).setTo(std::nanf(""));
    const cv::Mat found = look_again(scene.reference, scene.sources(), off * scene.truth,
                                     setting.options, stereo.map);
    EXPECT_EQ(cv::countNonZero(found & ~(stereo.map.depth > 0.0f)), 0);
    for (int y = 0; y < whole.rows; ++y)
      for (int x = 0; x < whole.cols; ++x) {
        if (!(whole.at<float>(y, x) > 0.0f)) continue;
        const float z = stereo.map.depth.at<float>(y, x);
        if (!gap.contains({x, y})) {
          EXPECT_EQ(found.at<uchar>(y, x), 0);
          EXPECT_EQ(z, whole.at<float>(y, x));
        } else {
          EXPECT_EQ(found.at<uchar>(y, x) != 0, z > 0.0f);
        }
      }
    stereo.map.depth.setTo(std::nanf(""), found == 0);
    return std::pair{errors_of(stereo),
                     cv::countNonZero(found(gap)) / static_cast<double>(gap.area())};
  };
  const auto [errors, share] = again(1.01);
  EXPECT_GE(share, 0.9);
  EXPECT_LE(errors.median, kTwentiethOfAPixel);
  EXPECT_GE(errors.within_three, 0.97);
  EXPECT_LE(again(1.15).second, 2.0 * kChance);  // 1.6 px off on the coarser level
}

TEST(DenseDepth, FewSourcesOrNoPriorFindNothing) {
  const PinholeGrid grid = small_grid();
  const DenseOptions options;
  const DenseWall wall = plane_wall(Vec3::UnitZ(), kDistance);
  const Mottling mottling(3, 0.3);
  const WideFrame picture = draw_frame(
      wall, [&](const Vec3& p) { return mottling(p); }, Rigid3{}, grid, kBrightAt, 0.0, 0);
  const StereoView view = stereo_view(picture, Rigid3{}, grid, options);
  const DepthPrior prior{true_depth(wall, Rigid3{}, view.levels.back().grid), 0.2};
  EXPECT_EQ(cv::countNonZero(estimate_depth(view, {&view}, prior, options).depth > 0), 0);
  EXPECT_EQ(cv::countNonZero(estimate_depth(view, {&view, &view}, {}, options).depth > 0), 0);
  // Sources in the reference's own place tell no depth.
  EXPECT_EQ(cv::countNonZero(estimate_depth(view, {&view, &view}, prior, options).depth > 0), 0);
}

TEST(DenseDepth, AReflectionIsUnknownAndBendsNothingBesideIt) {
  const PinholeGrid grid = small_grid();
  const DenseOptions options;
  const DenseWall wall = plane_wall(Vec3::UnitZ(), kDistance);
  const Mottling mottling(3, 0.3);
  std::vector<StereoView> views;
  for (int i = 0; i < 5; ++i) {
    const double angle = kPi / 2.0 * i;
    const Vec3 centre =
        i == 4 ? Vec3::Zero() : Vec3(kBaseline * Vec3(std::cos(angle), std::sin(angle), 0.0));
    const Rigid3 cam_from_world = looking(centre, Vec3::UnitZ());
    WideFrame picture = draw_frame(
        wall, [&](const Vec3& p) { return mottling(p); }, cam_from_world, grid, kBrightAt, 0.0, 0);
    // A highlight stays in the picture's middle when the camera moves: it would be matched there.
    const cv::Rect highlight(76, 56, 8, 8);
    picture.bgr(highlight).setTo(cv::Scalar::all(255.0));
    picture.known(highlight).setTo(0);
    views.push_back(stereo_view(picture, cam_from_world, grid, options));
  }
  const DepthPrior prior{1.05 * true_depth(wall, Rigid3{}, views[4].levels.back().grid), 0.2};
  const DepthMap map =
      estimate_depth(views[4], {&views[0], &views[1], &views[2], &views[3]}, prior, options);
  int beside = 0;
  for (int y = 48; y < 72; ++y)
    for (int x = 68; x < 92; ++x) {
      const float z = map.depth.at<float>(y, x);
      if (x >= 76 && x < 84 && y >= 56 && y < 64) {
        EXPECT_TRUE(std::isnan(z));
      } else if (z > 0.0f) {
        ++beside;
        EXPECT_NEAR(z, kDistance, 4.0 * kTwentiethOfAPixel * kDistance);
      }
    }
  EXPECT_GE(beside, 300);  // of 512
}

TEST(DenseDepth, ScalingTheWorldScalesTheDepthOnly) {
  constexpr double kScale = 1024.0;  // a power of two: exact in floating point
  Setting metres;
  metres.scale = kScale;
  metres.wall = plane_wall({0.3, -0.2, 1.0}, kScale * kDistance);
  const Stereo a = estimate({}), b = estimate(metres);
  int compared = 0;
  for (int y = 0; y < a.map.depth.rows; ++y)
    for (int x = 0; x < a.map.depth.cols; ++x) {
      const float za = a.map.depth.at<float>(y, x), zb = b.map.depth.at<float>(y, x);
      if (!(za > 0.0f) || !(zb > 0.0f)) continue;
      ++compared;
      // Pictures of the two worlds differ in their last bits.
      ASSERT_NEAR(zb / kScale, za, 1e-4 * za);
      ASSERT_NEAR(b.map.sigma.at<float>(y, x) / kScale, a.map.sigma.at<float>(y, x),
                  1e-2 * a.map.sigma.at<float>(y, x));
    }
  EXPECT_GE(compared, 0.9 * static_cast<double>(a.map.depth.total()));
}

TEST(DenseDepth, PriorFollowsItsPoints) {
  const PinholeGrid grid = small_grid();
  const DenseWall wall = plane_wall({0.3, -0.2, 1.0}, kDistance);
  const cv::Mat truth = true_depth(wall, Rigid3{}, grid);
  Structure structure;
  structure.frames = {0, 1};
  structure.placed = {true, true};
  structure.cam_from_world = {Rigid3{}, Rigid3{}};
  for (int y = 4; y < grid.height; y += 10)
    for (int x = 4; x < grid.width; x += 10) {
      Track track;
      track.observations = {{0, {x + 0.5, y + 0.5}}};
      track.point = static_cast<double>(truth.at<float>(y, x)) * grid.ray(x, y);
      track.triangulated = true;
      structure.tracks.push_back(track);
    }
  const DepthPrior prior = depth_prior(structure, 0, grid);
  ASSERT_FALSE(prior.depth.empty());
  EXPECT_GE(prior.reach_ln, 0.1);
  for (int y = 0; y < grid.height; ++y)
    for (int x = 0; x < grid.width; ++x)
      ASSERT_NEAR(prior.depth.at<float>(y, x), truth.at<float>(y, x), 0.01 * truth.at<float>(y, x));
  EXPECT_TRUE(depth_prior(structure, 1, grid).depth.empty());  // sees none of the points
}

}  // namespace
}  // namespace rugae
