#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/check.h"
#include "core/files.h"
#include "recon/preprocess/reflections.h"
#include "render/simulate.h"
#include "studies/measure.h"
#include "tests/studies/in_temporary_folder.h"
#include "tests/studies/small_set.h"

namespace rugae {
namespace {

using nlohmann::json;
using test::SmallSet;

constexpr int kWidth = 64, kHeight = 48;

// A wall with a small bright spot.
cv::Mat with_spot(int x, int y) {
  cv::Mat gray(kHeight, kWidth, CV_8U, cv::Scalar(80));
  cv::circle(gray, {x, y}, 3, cv::Scalar(250), cv::FILLED);
  return gray;
}

FrameTruth masks(const cv::Mat& specular, const cv::Mat& saturated = {}) {
  FrameTruth truth;
  truth.masks = cv::Mat(kHeight, kWidth, CV_8U, cv::Scalar(kMaskValid));
  truth.masks.setTo(kMaskValid | kMaskSpecular, specular);
  if (!saturated.empty()) cv::bitwise_or(truth.masks, kMaskSaturated, truth.masks, saturated);
  return truth;
}

ReflectionMeasureOptions by(const std::vector<double>& shares) {
  ReflectionMeasureOptions options;
  options.shares = shares;
  return options;
}

class MeasureReflections : public InTemporaryFolder {
 protected:
  json measure(const ReflectionMeasureOptions& options = {}) {
    return measure_reflections(folder_ / "data", options, progress_).at("reflections");
  }
  static SmallSet set() {
    SmallSet set(kWidth, kHeight, 40.0);
    set.labels.masks = true;
    return set;
  }
  Progress progress_{Progress::Output::silent};
};

void expect_scores(const json& scores, const json& precision, const json& recall, const json& f1,
                   const json& iou) {
  EXPECT_EQ(scores.at("precision"), precision);
  EXPECT_EQ(scores.at("recall"), recall);
  EXPECT_EQ(scores.at("f1"), f1);
  EXPECT_EQ(scores.at("iou"), iou);
}

TEST_F(MeasureReflections, AMaskThatIsTheTruthIsPerfect) {
  SmallSet set = this->set();
  for (const int x : {20, 30}) {
    set.grays.push_back(with_spot(x, 25));
    set.truth.push_back(masks(detect_reflections(set.grays.back(), {})));
  }
  set.write(folder_ / "data");
  const json m = measure();
  EXPECT_EQ(m.at("frames"), 2);
  EXPECT_EQ(m.at("frames_with_true"), 2);
  EXPECT_TRUE(m.at("true_share").get<double>() > 0.0);
  EXPECT_EQ(m.at("true_share"), m.at("found_share"));
  expect_scores(m.at("pooled"), 1.0, 1.0, 1.0, 1.0);
  expect_scores(m.at("mean"), 1.0, 1.0, 1.0, 1.0);
  EXPECT_TRUE(m.at("by_share").is_null());  // there are no labels of light
}

TEST_F(MeasureReflections, NothingFoundHasNoPrecisionAndNothingTrueNoRecall) {
  SmallSet set = this->set();
  const cv::Mat even(kHeight, kWidth, CV_8U, cv::Scalar(80)), none = even == 0;
  set.grays = {even, even};
  set.truth = {masks(with_spot(20, 20) > 100), masks(none)};
  set.write(folder_ / "data");
  json m = measure();
  expect_scores(m.at("pooled"), nullptr, 0.0, 0.0, 0.0);
  expect_scores(m.at("mean"), nullptr, 0.0, 0.0, 0.0);  // of the one frame that has them
  EXPECT_EQ(m.at("frames_with_true"), 1);
  EXPECT_EQ(m.at("frames_with_found"), 0);

  std::filesystem::remove_all(folder_ / "data");
  set.grays = {with_spot(20, 20), even};
  set.truth = {masks(none), masks(none)};
  set.write(folder_ / "data");
  m = measure();
  expect_scores(m.at("pooled"), 0.0, nullptr, 0.0, 0.0);
  EXPECT_EQ(m.at("frames_with_found"), 1);

  std::filesystem::remove_all(folder_ / "data");
  set.grays = {even, even};
  set.write(folder_ / "data");
  m = measure();
  for (const char* key : {"pooled", "mean", "saturated", "unsaturated"})
    expect_scores(m.at(key), nullptr, nullptr, nullptr, nullptr);
}

// Two frames, one found whole and one not at all: pooled counts pixels, the mean counts frames.
TEST_F(MeasureReflections, PooledCountsPixelsAndMeanCountsFrames) {
  SmallSet set = this->set();
  const cv::Mat even(kHeight, kWidth, CV_8U, cv::Scalar(80));
  set.grays = {with_spot(30, 20), even};
  const cv::Mat found = detect_reflections(set.grays[0], {});
  cv::Mat large(kHeight, kWidth, CV_8U, cv::Scalar(0));
  large(cv::Rect(0, 0, 32, 48)).setTo(255);
  set.truth = {masks(found), masks(large)};
  set.write(folder_ / "data");
  const json m = measure();
  const double n = cv::countNonZero(found);
  EXPECT_DOUBLE_EQ(m.at("pooled").at("recall").get<double>(), n / (n + 32 * 48));
  EXPECT_EQ(m.at("mean").at("recall"), 0.5);
  EXPECT_EQ(m.at("pooled").at("precision"), 1.0);
}

TEST_F(MeasureReflections, SaturatedPixelsAndTheOthersApart) {
  SmallSet set = this->set();
  const cv::Mat gray = with_spot(30, 20), found = detect_reflections(gray, {});
  // Half of what is found is saturated, and truly specular; the rest is not.
  cv::Mat left = found.clone();
  left.colRange(31, kWidth).setTo(0);
  ASSERT_TRUE(cv::countNonZero(left) > 5 && cv::countNonZero(found - left) > 5);
  set.grays = {gray, gray};
  set.truth = {masks(left, left), masks(left, left)};
  set.write(folder_ / "data");
  const json m = measure();
  expect_scores(m.at("saturated"), 1.0, 1.0, 1.0, 1.0);
  expect_scores(m.at("unsaturated"), 0.0, nullptr, 0.0, 0.0);
}

// Where the stop is, nothing counts: neither found nor true.
TEST_F(MeasureReflections, OnlyInsideTheFieldStop) {
  SmallSet set = this->set();
  set.camera.lens.stop.shape = StopShape::circle;
  set.camera.lens.stop.radius = 0.9;
  cv::Mat field(kHeight, kWidth, CV_8U, cv::Scalar(0));
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      if (set.camera.lens.passes_stop({x + 0.5, y + 0.5})) field.at<unsigned char>(y, x) = 255;
  cv::Mat gray = with_spot(30, 20);
  gray.setTo(0, field == 0);
  set.grays = {gray, gray};
  const cv::Mat found = detect_reflections(gray, {}, field);
  set.truth = {masks(found | (field == 0)), masks(found | (field == 0))};
  set.write(folder_ / "data");
  expect_scores(measure().at("pooled"), 1.0, 1.0, 1.0, 1.0);
}

// The light of a spot is specular by a share that falls outwards: every definition of a highlight
// has its own truth.
TEST_F(MeasureReflections, TheCurveFollowsTheShareOfSpecularLight) {
  SmallSet set = this->set();
  set.labels.diffuse = set.labels.specular = true;
  const cv::Mat gray = with_spot(30, 20), found = detect_reflections(gray, {});
  FrameTruth truth = masks(found);
  truth.diffuse = cv::Mat(kHeight, kWidth, CV_32FC3, cv::Scalar(0.4, 0.2, 0.1));
  truth.specular = cv::Mat(kHeight, kWidth, CV_32F, cv::Scalar(0.0));
  const double light = 0.2126 * 0.4 + 0.7152 * 0.2 + 0.0722 * 0.1;
  // 60 % where it was found, 30 % in another column, which was not.
  truth.specular.setTo(light * 0.6 / 0.4, found);
  truth.specular.col(2).setTo(light * 0.3 / 0.7);
  set.grays = {gray, gray};
  set.truth = {truth, truth};
  set.write(folder_ / "data");
  const json curve = measure(by({0.25, 0.5, 0.75})).at("by_share");
  const double n = cv::countNonZero(found), all = kWidth * kHeight;
  const json &wide = curve.at("above_25_percent"), &exact = curve.at("above_50_percent"),
             &narrow = curve.at("above_75_percent");
  EXPECT_DOUBLE_EQ(wide.at("recall").get<double>(), n / (n + kHeight));
  EXPECT_DOUBLE_EQ(wide.at("true_share").get<double>(), (n + kHeight) / all);
  EXPECT_EQ(wide.at("precision"), 1.0);
  expect_scores(exact, 1.0, 1.0, 1.0, 1.0);
  expect_scores(narrow, 0.0, nullptr, 0.0, 0.0);
}

// On rendered frames: at the masks' own share the curve is the masks', and threads change nothing.
TEST_F(MeasureReflections, OfRenderedFrames) {
  write_atomic(folder_ / "camera.yaml",
               "name: small\ndiameter_mm: 5\nlens: {width: 160, height: 120, horizontal_fov_deg: "
               "100}\nsensor: {pixel_pitch_um: 6, fps: 30, bit_depth: 10, full_well_e: 18000, "
               "read_noise_e: 10, shutter: global}\n");
  write_atomic(folder_ / "path.yaml", "like: '1'\nlength_cm: 2.4\npasses: 1\n");
  SimulateOptions options;
  options.camera = (folder_ / "camera.yaml").string();
  options.trajectory = (folder_ / "path.yaml").string();
  options.resolution = "coarse";
  options.frames = 4;
  options.render.truth.labels.diffuse = options.render.truth.labels.specular = true;
  simulate(options, folder_ / "data", progress_);
  const json m = measure();
  EXPECT_TRUE(m.at("true_share").get<double>() > 0.01);
  // Labels of light are divided by full scale in single precision: a pixel at the very share may
  // fall to either side.
  for (const char* score : {"precision", "recall", "f1", "iou"})
    EXPECT_NEAR(m.at("by_share").at("above_25_percent").at(score).get<double>(),
                m.at("pooled").at(score).get<double>(), 1e-3);
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(measure().dump(), m.dump());
}

TEST_F(MeasureReflections, BrokenOptionsAreNamed) {
  EXPECT_THROW(measure(by({0.0})), Error);
  EXPECT_THROW(measure(by({std::nan("")})), Error);
}

}  // namespace
}  // namespace rugae
