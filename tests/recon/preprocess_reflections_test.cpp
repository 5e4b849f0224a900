#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/photo.hpp>

#include "recon/preprocess/reflections.h"
#include "recon/preprocess/undistort.h"
#include "synthetic_texture.h"

namespace rugae {
namespace {

using testing::draw;
using testing::Texture;
using testing::to_8bit;

constexpr int kWidth = 640, kHeight = 480;

cv::Mat wall() {
  const Texture texture(4, 30.0, 200.0);
  return to_8bit(draw(kWidth, kHeight, [&](const Vec2& p) { return 0.15 + 0.5 * texture(p); }));
}

TEST(Reflections, HighlightsAreFoundAndTheWallIsNot) {
  cv::Mat gray = wall();
  cv::Mat spots = cv::Mat::zeros(gray.size(), CV_8U);
  for (int i = 0; i < 6; ++i) cv::circle(spots, {80 + 95 * i, 120 + 40 * i}, 4, 255, cv::FILLED);
  gray.setTo(250, spots);
  const cv::Mat found = detect_reflections(gray, {});
  cv::Mat wide;
  cv::dilate(spots, wide, cv::getStructuringElement(cv::MORPH_ELLIPSE, {21, 21}));
  const int hit = cv::countNonZero(found & spots);
  EXPECT_GE(hit, cv::countNonZero(spots) * 9 / 10);  // the closing fills the flat insides
  EXPECT_LE(cv::countNonZero(found & ~wide), gray.total() / 20);
  // A bright smooth slope alone is not a reflection: both conditions are needed.
  EXPECT_EQ(
      cv::countNonZero(detect_reflections(cv::Mat(kHeight, kWidth, CV_8U, cv::Scalar(200)), {})),
      0);
}

TEST(Reflections, SuppressionBringsTheWallBack) {
  const cv::Mat clean = wall();
  cv::Mat gray = clean.clone(), mask = cv::Mat::zeros(gray.size(), CV_8U);
  cv::circle(mask, {300, 200}, 6, 255, cv::FILLED);
  gray.setTo(255, mask);
  for (const Inpainting method : {Inpainting::telea, Inpainting::navier_stokes}) {
    ReflectionOptions options;
    options.inpainting = method;
    const cv::Mat painted = suppress_reflections(gray, mask, options);
    cv::Mat difference;
    cv::absdiff(painted, clean, difference);
    EXPECT_TRUE(cv::mean(difference, mask)[0] <= 12.0) << cv::mean(difference, mask)[0];
    EXPECT_EQ(cv::countNonZero(difference & ~mask), 0);
  }
}

TEST(Reflections, PiecesArePaintedAsInTheWholePicture) {
  const cv::Mat gray = wall();
  cv::Mat bgr, mask = cv::Mat::zeros(gray.size(), CV_8U);
  cv::cvtColor(gray, bgr, cv::COLOR_GRAY2BGR);
  cv::RNG random(3);
  for (int i = 0; i < 150; ++i)  // some touch, some lie a few pixels apart, some cross the border
    cv::circle(mask, {random.uniform(0, kWidth), random.uniform(0, kHeight)}, random.uniform(1, 9),
               255, cv::FILLED);
  for (const Inpainting method : {Inpainting::telea, Inpainting::navier_stokes})
    for (const double radius_px : {3.0, 8.0})
      for (const cv::Mat& picture : {gray, bgr}) {
        ReflectionOptions options;
        options.inpainting = method;
        options.inpaint_radius_px = radius_px;
        cv::Mat whole;
        cv::inpaint(picture, mask, whole, radius_px,
                    method == Inpainting::telea ? cv::INPAINT_TELEA : cv::INPAINT_NS);
        EXPECT_EQ(cv::norm(suppress_reflections(picture, mask, options), whole, cv::NORM_INF), 0.0);
      }
}

TEST(Undistortion, StraightensWhatTheLensBent) {
  Lens lens;
  lens.width = 320;
  lens.height = 240;
  lens.fx = lens.fy = 140.0;
  lens.cx = 161.0;
  lens.cy = 119.0;
  lens.k1 = -0.2;
  lens.k2 = 0.03;
  const Texture texture(9, 12.0, 60.0);
  // The picture shows texture(x/z, y/z) through the lens; the undistorted one through the pinhole.
  const auto seen_by = [&](const Lens& by) {
    return draw(by.width, by.height, [&](const Vec2& p) {
      const Vec3 ray = by.unproject(p).value();
      return texture(140.0 * ray.hnormalized());
    });
  };
  const Undistortion undistortion(lens, lens.pinhole());
  EXPECT_EQ(cv::countNonZero(undistortion.valid()), lens.width * lens.height);
  const cv::Mat straight = undistortion.image(seen_by(lens));
  cv::Mat difference;
  cv::absdiff(straight, seen_by(lens.pinhole()), difference);
  const cv::Rect inside(2, 2, lens.width - 4, lens.height - 4);
  double worst = 0.0;
  cv::minMaxLoc(difference(inside), nullptr, &worst);
  // Positions are tabulated in 1/32 px; the steepest wall changes by 0.4 a pixel at most.
  EXPECT_TRUE(worst <= 0.4 / 32.0) << worst;
}

TEST(Undistortion, PixelsWithoutAnOriginalAreInvalid) {
  Lens lens;
  lens.width = 320;
  lens.height = 240;
  lens.fx = lens.fy = 200.0;
  lens.cx = 160.0;
  lens.cy = 120.0;
  lens.k1 = 0.3;  // pincushion: the pinhole's border looks beyond the picture
  const Undistortion undistortion(lens, lens.pinhole());
  EXPECT_EQ(undistortion.valid().at<unsigned char>(0, 0), 0);
  EXPECT_EQ(undistortion.valid().at<unsigned char>(120, 160), 255);
  const cv::Mat white(240, 320, CV_8UC3, cv::Scalar(255, 255, 255));
  EXPECT_EQ(undistortion.image(white).at<cv::Vec3b>(0, 0), cv::Vec3b(0, 0, 0));
}

}  // namespace
}  // namespace rugae
