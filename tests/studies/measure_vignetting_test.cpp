#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "core/check.h"
#include "studies/light_alone.h"
#include "studies/measure.h"
#include "studies/tone_curve.h"
#include "tests/recon/synthetic_texture.h"
#include "tests/studies/in_temporary_folder.h"
#include "tests/studies/small_set.h"

namespace rugae {
namespace {

using nlohmann::json;
using test::SmallSet;

constexpr int kWidth = 160, kHeight = 120;
constexpr double kFocal_px = 80.0, kPlane_mm = 20.0;
// What the estimate itself leaves of a fall-off, in pictures of 8 bits whose brighter texture is
// taken for reflections here and there: 4 to 8 % were seen of an even light, 14 % where the light
// is brightest in the middle.
constexpr double kLeft = 0.1, kLeftOfLight = 0.2;

const char* const kTones[] = {"srgb", "gamma22", "linear"};
ToneCurve curve(int tone) { return ToneCurve(static_cast<Tone>(tone)); }

class MeasureVignetting : public InTemporaryFolder {
 protected:
  // A textured plane before the camera and, so that radial gradients are symmetric, its reciprocal,
  // seen through the camera's lens, in the light of its lights or an even one.
  static SmallSet set(const Camera& camera, int tone, bool lights, double mm_per_unit = 1.0) {
    SmallSet set(kWidth, kHeight, kFocal_px);
    set.camera = camera;
    set.options = fmt::format("{{\"sensor\": {{\"tone\": \"{}\"}}}}", kTones[tone]);
    set.labels.depth = set.labels.normals = lights;
    FrameTruth truth;
    truth.depth_mm = cv::Mat(kHeight, kWidth, CV_32F, cv::Scalar(kPlane_mm / mm_per_unit));
    truth.normal = cv::Mat(kHeight, kWidth, CV_32FC3, cv::Scalar(0.0, 0.0, -1.0));
    const testing::Texture texture(4, 6.0, 40.0);
    for (const double sign : {1.0, -1.0}) {
      const cv::Mat picture = testing::draw(kWidth, kHeight, [&](const Vec2& px) {
        const Vec3 ray = *camera.lens.unproject(px);
        const double c = ray.z();
        const double light = lights ? c * c * c : 1.0;  // cos / d^2 at d = z / cos
        const double wall = 0.4 * std::exp(0.4 * sign * (texture(px) - 0.5));
        const double v = vignette_at(camera.vignetting, camera.lens, px, ray);
        return curve(tone).stored(wall * light * v);
      });
      set.grays.push_back(testing::to_8bit(picture));
      set.truth.push_back(truth);
    }
    return set;
  }
  static Camera camera(double v1) {
    Camera camera = SmallSet(kWidth, kHeight, kFocal_px).camera;
    camera.vignetting.v1 = v1;
    return camera;
  }

  json measure(const SmallSet& set, const VignettingMeasureOptions& options = {}) {
    std::filesystem::remove_all(folder_ / "data");
    set.write(folder_ / "data");
    Progress progress(Progress::Output::silent);
    return measure_vignetting(folder_ / "data", options, progress).at("vignetting");
  }
};

double at(const json& m, const char* key) { return m.at(key).get<double>(); }

void expect_known(const json& m) {
  EXPECT_TRUE(at(m, "rms_ln_before") >= 0.05) << m.dump(1);
  EXPECT_TRUE(at(m, "rms_ln_after") <= kLeft * at(m, "rms_ln_before")) << m.dump(1);
  EXPECT_TRUE(std::abs(at(m, "corner_ln_error")) <= kLeft * -std::log(at(m, "corner_true")))
      << m.dump(1);
}

TEST_F(MeasureVignetting, AKnownProfileComesBackWhateverTheToneCurve) {
  for (int tone = 0; tone < 3; ++tone) {
    SCOPED_TRACE(kTones[tone]);
    const json m = measure(set(camera(-0.5), tone, false));
    EXPECT_EQ(m.at("frames"), 2);
    expect_known(m);
    // The corner pixel is half a pixel from half the diagonal.
    EXPECT_NEAR(at(m, "corner_radius_share"), 1.0, 0.01);
    const double e = at(m, "exponent_mean");
    if (tone == 0) {
      EXPECT_TRUE(e > 0.43 && e < 0.56) << e;  // the slope of sRGB between white and 1/20
    } else {
      EXPECT_NEAR(e, tone == 1 ? 1.0 / 2.2 : 1.0, 1e-9);
      EXPECT_NEAR(at(m, "corner_true"), std::pow(0.5, e), 0.01);
    }
    EXPECT_TRUE(m.at("rms_ln_after_light").is_null() && m.at("corner_light").is_null());
    EXPECT_EQ(m.at("profile").at("true").size(), m.at("profile").at("estimated").size());
  }
}

// The pictures are undistorted: a pixel's V is that of the place in the frame that it comes from.
TEST_F(MeasureVignetting, AKnownProfileComesBackFromUndistortedPictures) {
  Camera bent = camera(-0.5);
  bent.lens.k1 = -0.08;
  const json moved = measure(set(bent, 2, false));
  expect_known(moved);
  VignettingMeasureOptions options;
  options.preprocess.undistort = false;
  const json kept = measure(set(bent, 2, false), options);
  expect_known(kept);
  // A pixel of the undistorted corner comes from nearer to the centre.
  EXPECT_TRUE(at(moved, "corner_true") > at(kept, "corner_true") + 0.02);
}

// A perfect lens and a light that goes with the camera: all of the estimate is the light's.
TEST_F(MeasureVignetting, WhatTheLightExplainsIsToldApart) {
  for (const double v1 : {0.0, -0.3}) {
    const json m = measure(set(camera(v1), 0, true));
    EXPECT_TRUE(at(m, "rms_ln_after") >= 0.1) << m.dump(1);
    EXPECT_TRUE(at(m, "rms_ln_after_light") <= kLeftOfLight * at(m, "rms_ln_after")) << m.dump(1);
    EXPECT_TRUE(at(m, "light_share") >= 1.0 - kLeftOfLight * kLeftOfLight) << m.dump(1);
    EXPECT_TRUE(std::abs(at(m, "corner_ln_error_light")) <=
                kLeftOfLight * std::abs(at(m, "corner_ln_error")))
        << m.dump(1);
    // At the outermost pixel: cos^3, stored.
    const double cosine = camera(v1).lens.unproject({0.5, 0.5})->z();
    EXPECT_NEAR(at(m, "corner_light"), std::pow(cosine, 3.0 * at(m, "exponent_mean")), 0.02);
    if (v1 == 0.0) {
      EXPECT_TRUE(at(m, "rms_ln_before") <= 1e-9);
      EXPECT_EQ(at(m, "corner_true"), 1.0);
    }
  }
  // The unit of length is not in it.
  const json mm = measure(set(camera(-0.3), 0, true)),
             metres = measure(set(camera(-0.3), 0, true, 1000.0));
  EXPECT_NEAR(at(mm, "rms_ln_after_light"), at(metres, "rms_ln_after_light"), 1e-6);
}

TEST_F(MeasureVignetting, BrokenInputIsNamed) {
  VignettingMeasureOptions options;
  options.preprocess.devignette = false;
  EXPECT_THROW(measure(set(camera(-0.5), 0, false), options), Error);
  SmallSet black = set(camera(-0.5), 0, false);
  for (cv::Mat& gray : black.grays) gray.setTo(0);
  EXPECT_THROW(measure(black), Error);
}

TEST(LightAlone, IsTheInverseSquareAndTheCosine) {
  const Lens lens = SmallSet(kWidth, kHeight, kFocal_px).camera.lens;
  const cv::Mat normal(kHeight, kWidth, CV_32FC3, cv::Scalar(0.0, 0.0, -1.0));
  cv::Mat depth(kHeight, kWidth, CV_32F, cv::Scalar(kPlane_mm));
  depth.at<float>(7, 11) = std::nanf("");
  Emitter beside;
  beside.offset_mm = Vec3(5.0, -3.0, 1.0);
  beside.lobe = 1.5;
  beside.intensity = 2.0;
  const cv::Mat central = light_alone(depth, normal, lens, {Emitter{}}),
                both = light_alone(depth, normal, lens, {Emitter{}, beside});
  EXPECT_EQ(central.at<float>(7, 11), 0.0f);
  for (const auto& [x, y] : {std::pair{0, 0}, {80, 60}, {140, 33}}) {
    // The plane's point of the pixel, by hand.
    const Vec3 p(kPlane_mm * (x + 0.5 - 80.0) / kFocal_px, kPlane_mm * (y + 0.5 - 60.0) / kFocal_px,
                 kPlane_mm);
    const double d = p.norm();
    const double expected = kPlane_mm / (d * d * d);
    EXPECT_NEAR(central.at<float>(y, x), expected, 1e-6 * expected);
    const Vec3 from = p - beside.offset_mm;
    const double e = from.norm(), cosine = from.z() / e;
    const double more = 2.0 * std::exp(-1.5 * (1.0 - cosine)) / (e * e) * cosine;
    EXPECT_NEAR(both.at<float>(y, x), expected + more, 1e-6 * (expected + more));
  }
}

TEST(LightAlone, ThePictureIsAsBrightAsTheFrame) {
  // Light of 2 through a lens that takes half of it, seen as 64 of a linear sensor: 1 of light is
  // 64, without the lens 2 are 128.
  const cv::Mat light(4, 4, CV_32F, cv::Scalar(2.0)), through(4, 4, CV_32F, cv::Scalar(0.5)),
      gray(4, 4, CV_8U, cv::Scalar(64)), black(4, 4, CV_8U, cv::Scalar(0));
  const cv::Mat picture = picture_of_light(light, through, gray, ToneCurve(Tone::linear));
  EXPECT_EQ(cv::norm(picture, cv::Mat(4, 4, CV_8U, cv::Scalar(128)), cv::NORM_INF), 0.0);
  EXPECT_TRUE(picture_of_light(light, through, black, ToneCurve(Tone::linear)).empty());
  EXPECT_TRUE(picture_of_light(0.0 * light, through, gray, ToneCurve(Tone::linear)).empty());
}

}  // namespace
}  // namespace rugae
