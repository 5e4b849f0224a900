#include "render/isp.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "core/random.h"

namespace rugae {
namespace {

constexpr Bayer kPatterns[] = {Bayer::rggb, Bayer::bggr, Bayer::grbg, Bayer::gbrg};

// The mosaic of a picture (CV_16UC3, BGR).
cv::Mat mosaic_of(const cv::Mat& bgr, Bayer pattern) {
  cv::Mat mosaic(bgr.size(), CV_16U);
  for (int y = 0; y < bgr.rows; ++y)
    for (int x = 0; x < bgr.cols; ++x)
      mosaic.at<std::uint16_t>(y, x) = bgr.at<cv::Vec3w>(y, x)[2 - bayer_channel(pattern, x, y)];
  return mosaic;
}

TEST(Isp, PatternsAreNamedByTheirFirstFourPhotosites) {
  const auto word = [](Bayer pattern) {
    std::string letters;
    for (int y : {0, 1})
      for (int x : {0, 1}) letters += "rgb"[bayer_channel(pattern, x + 2, y + 4)];
    return letters;
  };
  EXPECT_EQ(word(Bayer::rggb), "rggb");
  EXPECT_EQ(word(Bayer::bggr), "bggr");
  EXPECT_EQ(word(Bayer::grbg), "grbg");
  EXPECT_EQ(word(Bayer::gbrg), "gbrg");
}

TEST(Isp, DemosaicingAFlatColourIsExact) {
  for (Bayer pattern : kPatterns) {
    const cv::Mat flat(13, 18, CV_16UC3, cv::Scalar(211, 640, 1023));
    EXPECT_EQ(cv::norm(demosaic(mosaic_of(flat, pattern), pattern), flat, cv::NORM_INF), 0.0);
  }
}

// Steps of 4 in x and 6 in y, other for each colour: the means of two and four neighbours are whole
// numbers, so nothing is rounded. The outermost rows and columns are copies of their neighbours.
TEST(Isp, DemosaicingALinearRampIsExactAwayFromTheBorder) {
  for (Bayer pattern : kPatterns) {
    cv::Mat ramp(40, 60, CV_16UC3);
    for (int y = 0; y < ramp.rows; ++y)
      for (int x = 0; x < ramp.cols; ++x)
        ramp.at<cv::Vec3w>(y, x) = {static_cast<std::uint16_t>(100 + 4 * x + 6 * y),
                                    static_cast<std::uint16_t>(300 + 8 * x + 2 * y),
                                    static_cast<std::uint16_t>(900 - 4 * x - 2 * y)};
    const cv::Mat bgr = demosaic(mosaic_of(ramp, pattern), pattern);
    const cv::Rect inside(2, 2, ramp.cols - 4, ramp.rows - 4);
    EXPECT_EQ(cv::norm(bgr(inside), ramp(inside), cv::NORM_INF), 0.0);
  }
}

// Green follows the direction of the smaller difference: a vertical edge stays sharp. A bilinear
// interpolation would leave a quarter of the step beside it.
TEST(Isp, DemosaicingKeepsAnEdgeSharp) {
  for (Bayer pattern : kPatterns) {
    cv::Mat edge(20, 20, CV_16UC3, cv::Scalar::all(100));
    edge(cv::Rect(10, 0, 10, 20)).setTo(cv::Scalar::all(900));
    const cv::Mat bgr = demosaic(mosaic_of(edge, pattern), pattern);
    for (int y = 2; y < 18; ++y)
      for (int x = 2; x < 18; ++x)
        EXPECT_EQ(bgr.at<cv::Vec3w>(y, x)[1], edge.at<cv::Vec3w>(y, x)[1]) << x << " " << y;
  }
}

TEST(Isp, DemosaicingDoesNotDependOnThreadsOrVectorUnits) {
  cv::Mat mosaic(241, 323, CV_16U);
  for (int i = 0; i < static_cast<int>(mosaic.total()); ++i)
    mosaic.ptr<std::uint16_t>()[i] =
        static_cast<std::uint16_t>(random_words(1, Purpose::test, 0, i)[0] & 1023);
  std::uint64_t hash = 14695981039346656037ull;  // FNV-1a of all pictures
  for (Bayer pattern : kPatterns) {
    const cv::Mat first = demosaic(mosaic, pattern);
    for (const auto* byte = first.datastart; byte != first.dataend; ++byte)
      hash = (hash ^ *byte) * 1099511628211ull;
    const int threads = cv::getNumThreads();
    cv::setNumThreads(1);
    const cv::Mat alone = demosaic(mosaic, pattern);
    cv::setNumThreads(threads);
    cv::setUseOptimized(false);
    const cv::Mat plain = demosaic(mosaic, pattern);
    cv::setUseOptimized(true);
    EXPECT_EQ(cv::norm(first, alone, cv::NORM_INF), 0.0);
    EXPECT_EQ(cv::norm(first, plain, cv::NORM_INF), 0.0);
  }
  EXPECT_EQ(hash, 11478036989861176173u);
}

// The curves against the C library's power; 8-bit values of every converter's number are the same.
TEST(Isp, CurvesAreThoseOfTheirStandards) {
  constexpr double kCurveError = 1e-7;
  const auto srgb = [](double v) {
    return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1.0 / 2.4) - 0.055;
  };
  for (int i = 0; i <= 100000; ++i) {
    const double v = i / 100000.0;
    ASSERT_NEAR(display_value(Tone::srgb, v), srgb(v), kCurveError);
    ASSERT_NEAR(display_value(Tone::gamma22, v), std::pow(v, 1.0 / 2.2), kCurveError);
    ASSERT_EQ(display_value(Tone::linear, v), v);
  }
  for (int bits : {8, 10, 12, 14}) {
    const int top = (1 << bits) - 1;
    const DisplayTable table(Tone::srgb, 0, top);
    for (int number = 0; number <= top; ++number)
      ASSERT_EQ(table(0, number),
                static_cast<int>(std::floor(255.0 * srgb(number / double(top)) + 0.5)));
  }
}

TEST(Isp, TheTableTakesOffTheBlackLevelAndAppliesTheGains) {
  const DisplayTable table(Tone::linear, 64, 1023, {2.0, 1.0, 0.5});
  EXPECT_EQ(table(1, 0), 0);
  EXPECT_EQ(table(1, 64), 0);
  EXPECT_EQ(table(1, 1023), 255);
  const int half = 64 + 959 / 2;
  EXPECT_EQ(table(0, half), 255);  // twice 0.4995, rounded
  EXPECT_EQ(table(1, half), 127);
  EXPECT_EQ(table(2, half), 64);
  EXPECT_EQ(table(0, 1023), 255);
}

TEST(Isp, GreyWorldMakesTheMeanGrey) {
  cv::Mat light(10, 10, CV_32FC3, cv::Scalar(0.6, 0.3, 0.1));
  light(cv::Rect(0, 0, 10, 5)).setTo(cv::Scalar(0.2, 0.1, 0.1));
  light(cv::Rect(0, 0, 2, 2)).setTo(cv::Scalar::all(0.0));
  const Vec3 gains = grey_world_gains(light, 1.0);
  EXPECT_NEAR(gains[0], 0.5, 1e-6);
  EXPECT_EQ(gains[1], 1.0);
  EXPECT_NEAR(gains[2], (50 * 0.3 + 46 * 0.1) / (96 * 0.1), 1e-6);
  // white is full scale, however bright
  EXPECT_NEAR(grey_world_gains(cv::Mat(4, 4, CV_32FC3, cv::Scalar(9.0, 0.5, 0.5)), 1.0)[0], 0.5,
              1e-12);
  EXPECT_EQ(grey_world_gains(cv::Mat(4, 4, CV_32FC3, cv::Scalar(1.0, 0.1, 0.0)), 1.0)[0], 0.25);
  EXPECT_EQ(grey_world_gains(cv::Mat(4, 4, CV_32FC3, cv::Scalar::all(0.0)), 1.0), Vec3::Ones());
}

}  // namespace
}  // namespace rugae
