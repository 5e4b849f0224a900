#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/check.h"
#include "studies/measure.h"
#include "tests/studies/in_temporary_folder.h"
#include "tests/studies/two_planes.h"

namespace rugae {
namespace {

using nlohmann::json;
using test::TwoPlanes;
using Seen = TwoPlanes::Seen;

constexpr double kExact_px = 1e-6;  // poses are written with 17 digits, walls as doubles
constexpr double kMedian = 1e-3;    // of itself, as RunningErrors has it

FeatureMeasureOptions by_step(int step) {
  FeatureMeasureOptions options;
  options.step = step;
  return options;
}

class MeasureFeatures : public InTemporaryFolder {
 protected:
  json measure(const Matcher& matcher, const FeatureMeasureOptions& options = {},
               const std::string& folder = "data") {
    return measure_matches(folder_ / folder, "test", matcher, options, progress_).at("features");
  }
  json measure(FeatureMethod method, const FeatureMeasureOptions& options = {}) {
    return measure_features(folder_ / "data", method, options, progress_);
  }

  // Points between the pixels all over the picture, led by the truth and then moved by `off_px`;
  // hidden ones and those that leave the picture as well.
  Matcher truth_and(const Vec2& off_px) const {
    return [this, off_px](int i, int j, const cv::Mat&, const cv::Mat&, const cv::Mat&) {
      FeatureMatches matches;
      for (double y = 1.3; y < TwoPlanes::kHeight - 1; y += 3.7)
        for (double x = 1.1; x < TwoPlanes::kWidth - 1; x += 2.9) {
          matches.first_px.emplace_back(x, y);
          matches.second_px.emplace_back(world_.led(i, j, {x, y}).pixel + off_px);
        }
      return matches;
    };
  }

  TwoPlanes world_;
  Progress progress_{Progress::Output::silent};
};

TEST_F(MeasureFeatures, TrueMatchesHaveNoError) {
  world_.set().write(folder_ / "data");
  for (const int step : {1, 3}) {
    const json m = measure(truth_and(Vec2::Zero()), by_step(step));
    EXPECT_EQ(m.at("pairs"), TwoPlanes::kFrames - step);
    EXPECT_EQ(m.at("homography_share"), 1.0);
    EXPECT_TRUE(m.at("endpoint").at("all").at("max_px").get<double>() <= kExact_px) << m.dump(1);
    EXPECT_EQ(m.at("endpoint").at("all").at("within_1px_share"), 1.0);
    EXPECT_TRUE(m.at("endpoint").at("all").at("matches").get<int>() > 1000);
    EXPECT_TRUE(m.at("judged_share").get<double>() > 0.8);
    EXPECT_TRUE(m.at("true_motion_mean_px").get<double>() > 1.0 * step);
    EXPECT_EQ(m.at("coverage").at("all_share"), 1.0);
    // Two planes are no plane: even true matches are not led by one homography.
    EXPECT_TRUE(m.at("reprojection").at("of_truth_mean_px").get<double>() > 0.01);
  }
}

// The matches of one pair alone are wrong.
TEST_F(MeasureFeatures, AStrideLeavesPairsOut) {
  world_.set().write(folder_ / "data");
  const Matcher matcher = [this](int i, int j, const cv::Mat&, const cv::Mat&, const cv::Mat&) {
    return truth_and(i == 3 ? Vec2(0.0, 9.0) : Vec2(0.0, 0.0))(i, j, {}, {}, {});
  };
  const auto of = [&](int stride, int step) {
    FeatureMeasureOptions options;
    options.stride = stride;
    options.step = step;
    const json m = measure(matcher, options);
    return std::pair(m.at("pairs").get<int>(),
                     m.at("endpoint").at("all").at("max_px").get<double>() > 8.0);
  };
  static_assert(TwoPlanes::kFrames == 6);
  EXPECT_EQ(of(1, 1), std::pair(5, true));
  EXPECT_EQ(of(2, 1), std::pair(3, false));  // 0, 2, 4
  EXPECT_EQ(of(3, 1), std::pair(2, true));   // 0, 3
  EXPECT_EQ(of(3, 3), std::pair(1, false));  // 0
  EXPECT_EQ(of(9, 1), std::pair(1, false));
}

TEST_F(MeasureFeatures, ShiftedMatchesHaveTheShiftAsError) {
  world_.set().write(folder_ / "data");
  const json m = measure(truth_and(Vec2(1.5, -2.0)));  // 2.5 px
  for (const char* which : {"all", "inliers"}) {
    const json& e = m.at("endpoint").at(which);
    EXPECT_NEAR(e.at("mean_px").get<double>(), 2.5, kExact_px);
    EXPECT_NEAR(e.at("rmse_px").get<double>(), 2.5, kExact_px);
    EXPECT_NEAR(e.at("median_px").get<double>(), 2.5, kMedian * 2.5);
    EXPECT_EQ(e.at("within_1px_share"), 0.0);
    EXPECT_EQ(e.at("within_3px_share"), 1.0);
  }
  // A shift of all matches is no error of re-projection: the homography takes it up.
  const json straight = measure(truth_and(Vec2::Zero()));
  EXPECT_NEAR(m.at("reprojection").at("mean_px").get<double>(),
              straight.at("reprojection").at("mean_px").get<double>(), 0.05);
}

TEST_F(MeasureFeatures, EveryMatchIsCountedForWhatItIs) {
  world_.set().write(folder_ / "data");
  constexpr int kStep = 2;
  std::size_t all = 0, edge = 0, hidden = 0, outside = 0;
  for (int i = 0; i + kStep < TwoPlanes::kFrames; ++i) {
    const auto matches = truth_and(Vec2::Zero())(i, i + kStep, {}, {}, {});
    for (const Vec2& first : matches.first_px) {
      ++all;
      const Seen seen = world_.led(i, i + kStep, first).seen;
      if (world_.near_edge(i, first, 0.5))
        ++edge;
      else if (seen == Seen::hidden)
        ++hidden;
      else if (seen == Seen::outside)
        ++outside;
    }
  }
  ASSERT_TRUE(edge > 20 && hidden > 20 && outside > 20) << edge << " " << hidden << " " << outside;
  const json m = measure(truth_and(Vec2::Zero()), by_step(kStep));
  EXPECT_DOUBLE_EQ(m.at("edge_share").get<double>(), static_cast<double>(edge) / all);
  EXPECT_DOUBLE_EQ(m.at("hidden_share").get<double>(), static_cast<double>(hidden) / all);
  EXPECT_DOUBLE_EQ(m.at("outside_share").get<double>(), static_cast<double>(outside) / all);
  EXPECT_EQ(m.at("nowhere_share"), 0.0);
  EXPECT_EQ(m.at("endpoint").at("all").at("matches").get<std::size_t>(),
            all - edge - hidden - outside);
}

// The pictures are undistorted, the truth is looked up where their pixels were, and leads back.
TEST_F(MeasureFeatures, TrueMatchesOfUndistortedPicturesHaveNoError) {
  world_.set().write(folder_ / "data");
  const Lens observed = TwoPlanes::camera().lens, picture = observed.pinhole();
  const auto moved = [](const Lens& to, const Lens& from, const Vec2& px) {
    return *to.project(*from.unproject(px));
  };
  const Matcher matcher = [&](int i, int j, const cv::Mat&, const cv::Mat&, const cv::Mat&) {
    FeatureMatches matches = truth_and(Vec2::Zero())(i, j, {}, {}, {});
    for (Vec2& px : matches.first_px) px = moved(picture, observed, px);
    for (Vec2& px : matches.second_px)
      if (observed.contains(px)) px = moved(picture, observed, px);
    return matches;
  };
  FeatureMeasureOptions options;
  options.preprocess.emplace().devignette = false;
  const json m = measure(matcher, options);
  EXPECT_TRUE(m.at("endpoint").at("all").at("max_px").get<double>() <= kExact_px) << m.dump(1);
  // Taken for pixels of the frames as observed they are wrong.
  EXPECT_TRUE(measure(matcher).at("endpoint").at("all").at("mean_px").get<double>() > 0.05);
}

TEST_F(MeasureFeatures, CoverageIsTheShareOfCells) {
  world_.set().write(folder_ / "data");
  const Matcher quarter = [&](int i, int j, const cv::Mat&, const cv::Mat&, const cv::Mat&) {
    const FeatureMatches all = truth_and(Vec2::Zero())(i, j, {}, {}, {});
    FeatureMatches matches;
    for (std::size_t k = 0; k < all.first_px.size(); ++k)
      if (all.first_px[k].x() >= TwoPlanes::kWidth / 2 &&
          all.first_px[k].y() < TwoPlanes::kHeight / 2) {
        matches.first_px.push_back(all.first_px[k]);
        matches.second_px.push_back(all.second_px[k]);
      }
    return matches;
  };
  const json m = measure(quarter);
  EXPECT_DOUBLE_EQ(m.at("coverage").at("all_share").get<double>(), 0.25);
  EXPECT_TRUE(m.at("coverage").at("inliers_share").get<double>() <= 0.25);
}

void expect_near(const json& a, const json& b, double tolerance, const std::string& path) {
  if (a.is_object()) {
    for (const auto& [key, value] : a.items())
      expect_near(value, b.at(key), tolerance, path + "." + key);
  } else if (a.is_number()) {
    EXPECT_NEAR(a.get<double>(), b.get<double>(), tolerance) << path;
  } else {
    EXPECT_EQ(a, b) << path;
  }
}

// Errors are of pictures: neither where the world lies nor its unit of length is in them.
TEST_F(MeasureFeatures, AMovedWorldAndMetresChangeNothing) {
  const test::SmallSet set = world_.set();
  set.write(folder_ / "data");
  test::SmallSet other = set;
  const Rigid3 moved(Quat(Eigen::AngleAxisd(1.1, Vec3(1, -2, 0.5).normalized())),
                     Vec3(70, -30, 110));
  constexpr double kMetres = 1e-3;
  for (TimedPose& pose : other.track) {
    pose.world_from_camera = moved * pose.world_from_camera;
    pose.world_from_camera.translation *= kMetres;
  }
  for (Vec3& v : other.wall.vertices) v = kMetres * (moved * v);
  other.write(folder_ / "other");
  const Matcher matcher = [](int, int, const cv::Mat& a, const cv::Mat& b, const cv::Mat& valid) {
    return match_features(FeatureMethod::lucas_kanade, a, b, valid);
  };
  expect_near(measure(matcher), measure(matcher, {}, "other"), kExact_px, "features");
}

TEST_F(MeasureFeatures, TheSameForAnyNumberOfThreads) {
  world_.set().write(folder_ / "data");
  for (const FeatureMethod method : {FeatureMethod::farneback, FeatureMethod::orb}) {
    const json many = measure(method);
    json one;
    {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
      one = measure(method);
    }
    EXPECT_EQ(many.at("features").dump(), one.at("features").dump());
    EXPECT_TRUE(many.at("time").at("cpu_ms_per_pair").get<double>() > 0.0);
  }
}

// Sharp texture on two planes and small motions: most matches of every method are right.
TEST_F(MeasureFeatures, EveryMethodFindsTheTrueMotionOfTexture) {
  world_.set().write(folder_ / "data");
  for (const FeatureMethod method : kFeatureMethods) {
    SCOPED_TRACE(name_of(method));
    const json m = measure(method).at("features");
    EXPECT_EQ(m.at("homography_share"), 1.0);
    // SURF finds few blobs on so small a picture.
    EXPECT_TRUE(m.at("matches_per_pair").get<double>() > 5.0) << m.at("matches_per_pair");
    const json& all = m.at("endpoint").at("all");
    // Places of ORB and HOG are whole pixels: wrong by up to 0.7.
    EXPECT_TRUE(all.at("median_px").get<double>() <= 0.75) << all.dump(1);
    EXPECT_TRUE(m.at("true_motion_mean_px").get<double>() >= 1.5) << m.at("true_motion_mean_px");
    EXPECT_TRUE(m.at("reprojection").at("mean_px").get<double>() <= 3.0);
  }
}

TEST_F(MeasureFeatures, NothingToMatchIsNullNotZero) {
  world_.set(true).write(folder_ / "data");
  for (const FeatureMethod method : kFeatureMethods) {
    SCOPED_TRACE(name_of(method));
    const json m = measure(method).at("features");
    EXPECT_EQ(m.at("homography_share"), 0.0);
    EXPECT_EQ(m.at("matches_per_pair"), 0.0);
    EXPECT_EQ(m.at("coverage").at("all_share"), 0.0);
    EXPECT_TRUE(m.at("reprojection").at("mean_px").is_null());
    EXPECT_TRUE(m.at("endpoint").at("all").at("median_px").is_null());
    EXPECT_TRUE(m.at("endpoint").at("all").at("within_1px_share").is_null());
    EXPECT_TRUE(m.at("judged_share").is_null());
  }
}

TEST_F(MeasureFeatures, BrokenInputIsNamed) {
  world_.set().write(folder_ / "data");
  EXPECT_THROW(measure(FeatureMethod::orb, by_step(0)), Error);
  EXPECT_THROW(measure(FeatureMethod::orb, by_step(TwoPlanes::kFrames)), Error);
  FeatureMeasureOptions broken;
  broken.ransac_threshold_px = std::nan("");
  EXPECT_THROW(measure(FeatureMethod::orb, broken), Error);
  broken = {};
  broken.stride = 0;
  EXPECT_THROW(measure(FeatureMethod::orb, broken), Error);
  const auto frame = folder_ / "data" / "observations" / "frames" / "000003.png";
  std::filesystem::resize_file(frame, 40);
  try {
    measure(FeatureMethod::orb);
    FAIL() << "a broken frame went unnoticed";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("000003.png"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace rugae
