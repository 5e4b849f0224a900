#include "recon/align.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/LU>
#include <algorithm>
#include <cstring>
#include <opencv2/core.hpp>

#include "core/check.h"
#include "core/random.h"
#include "recon/patch_align.h"
#include "recon/refine.h"
#include "synthetic_texture.h"

namespace rugae {
namespace {

using testing::draw;
using testing::Texture;
using testing::to_8bit;

constexpr int kWidth = 320, kHeight = 240;

Frame frame_of(int index, const cv::Mat& gray) {
  Frame frame;
  frame.index = index;
  frame.gray = gray;
  frame.reflection = cv::Mat::zeros(gray.size(), CV_8U);
  frame.valid = cv::Mat(gray.size(), CV_8U, cv::Scalar(255));
  return frame;
}

// The moving picture shows at x what the reference shows at A x.
cv::Mat moving_picture(const Texture& texture, const Affine2& ref_from_mov) {
  return draw(kWidth, kHeight,
              [&](const Vec2& p) { return texture(ref_from_mov * p.homogeneous()); });
}

// A turn, a zoom and a shift about the image centre.
Affine2 similarity(double turn_rad, double zoom, const Vec2& shift_px) {
  const Mat2 linear = zoom * Eigen::Rotation2Dd(turn_rad).toRotationMatrix();
  const Vec2 center(0.5 * kWidth, 0.5 * kHeight);
  Affine2 affine;
  affine << linear, center + shift_px - linear * center;
  return affine;
}

double worst_corner_px(const Affine2& a, const Affine2& b) {
  double worst = 0.0;
  for (const Vec2& p : {Vec2(0, 0), Vec2(kWidth, 0), Vec2(0, kHeight), Vec2(kWidth, kHeight)})
    worst = std::max(worst, ((a - b) * p.homogeneous()).norm());
  return worst;
}

PatchPair whole_pair(const Texture& texture, const Affine2& ref_from_mov) {
  PatchPair pair;
  pair.reference = draw(kWidth, kHeight, texture);
  pair.moving = moving_picture(texture, ref_from_mov);
  pair.reference_patches = cv::Mat(kHeight, kWidth, CV_8U, cv::Scalar(255));
  pair.moving_patches = pair.reference_patches;
  return pair;
}

TEST(PatchAlign, PatchesAreOpenDiscs) {
  const cv::Mat mask = circular_patches({{10.5, 10.5}, {39.5, 0.5}}, 3.0, {40, 20});
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      const Vec2 p(x + 0.5, y + 0.5);
      const bool inside =
          (p - Vec2(10.5, 10.5)).squaredNorm() < 9.0 || (p - Vec2(39.5, 0.5)).squaredNorm() < 9.0;
      EXPECT_EQ(mask.at<unsigned char>(y, x) != 0, inside) << x << " " << y;
    }
  }
}

TEST(PatchAlign, GradientIsThatOfTheCost) {
  // Long waves, so that interpolation and central differences are nearly exact, and overlap that
  // does not change: patches well inside.
  const Texture texture(3, 40.0, 160.0);
  PatchPair pair = whole_pair(texture, similarity(0.0, 1.0, {0, 0}));
  pair.moving_patches =
      circular_patches({{160, 120}, {100, 90}, {230, 150}}, 25.0, {kWidth, kHeight});
  const Affine2 at = similarity(0.03, 1.02, {2.3, -1.7});
  const PatchCost cost = patch_cost(pair, at);
  ASSERT_GT(cost.overlap_px, 3000.0);
  const double s = 2.0 / kWidth;
  constexpr double kStep = 1e-3;
  for (int i = 0; i < 6; ++i) {
    Vec6 d = Vec6::Zero();
    d[i] = kStep;
    Affine2 change;  // the parameter's change, in pixels
    change << d[0], d[1], d[2] / s - d[0] * kWidth / 2.0 - d[1] * kHeight / 2.0,  //
        d[3], d[4], d[5] / s - d[3] * kWidth / 2.0 - d[4] * kHeight / 2.0;
    const double numeric = (patch_cost(pair, at + change).squared_error -
                            patch_cost(pair, at - change).squared_error) /
                           (2.0 * kStep);
    // Central differences of waves of 40 px and longer: (2 pi / 40)^2 / 6 = 0.4 %.
    EXPECT_NEAR(cost.gradient[i], numeric, 0.01 * cost.gradient.norm()) << i;
  }
}

TEST(PatchAlign, RecoversAKnownAffineTo002Px) {
  const Texture texture(1);
  Affine2 truth = similarity(0.04, 1.03, {6.4, -3.7});
  truth(0, 1) += 0.015;  // some shear
  AffineFitOptions options;
  options.stop_mse = 0.0;
  Affine2 start = Affine2::Identity();
  start.col(2) = Vec2(4.0, -5.0);
  const AffineFit fit = fit_affine(whole_pair(texture, truth), start, options);
  EXPECT_TRUE(fit.converged);
  EXPECT_TRUE(worst_corner_px(fit.ref_from_mov, truth) <= 0.02)
      << worst_corner_px(fit.ref_from_mov, truth) << " after " << fit.iterations;
}

TEST(PatchAlign, StopsBelowTheMseAndAfterTheIterations) {
  const Texture texture(1);
  const PatchPair pair = whole_pair(texture, similarity(0.02, 1.0, {3.0, 1.0}));
  const AffineFit loose = fit_affine(pair, Affine2::Identity(), {1.0, 100});
  EXPECT_TRUE(loose.converged);
  EXPECT_TRUE(loose.mse < 1.0);
  const AffineFit cut = fit_affine(pair, Affine2::Identity(), {0.0, 2});
  EXPECT_EQ(cut.iterations, 2);
  EXPECT_FALSE(cut.converged);
}

TEST(PatchAlign, WithoutTextureNothingIsConverged) {
  PatchPair pair = whole_pair(Texture(1), similarity(0.0, 1.0, {0, 0}));
  pair.reference.setTo(0.5);
  pair.moving.setTo(0.25);
  EXPECT_FALSE(fit_affine(pair, Affine2::Identity(), {0.0, 100}).converged);
}

TEST(RefinePoint, FindsThePlaceUnderAnotherGainAndOffset) {
  const Texture texture(5, 6.0, 40.0);
  const Affine2 mov_from_ref = similarity(0.05, 0.97, {5.3, 2.9});
  const Mat2 linear = mov_from_ref.leftCols<2>();
  const cv::Mat reference = draw(kWidth, kHeight, texture);
  const Affine2 ref_from_mov = [&] {
    Affine2 inverse;
    inverse << linear.inverse(), -linear.inverse() * mov_from_ref.col(2);
    return inverse;
  }();
  const cv::Mat moving = moving_picture(texture, ref_from_mov) * 0.6 + 0.1;
  PointRefinementOptions options;
  options.max_deviation_px = 1.0;  // this texture is free of noise: only the residual's size counts
  int tried = 0;
  std::vector<double> errors;
  for (double y = 40; y < kHeight - 40; y += 17.3) {
    for (double x = 40; x < kWidth - 40; x += 17.3) {
      ++tried;
      const Vec2 p(x, y), q = mov_from_ref * p.homogeneous();
      const auto place = refine_point(reference, moving, p, q + Vec2(0.6, -0.5), linear, options);
      if (!place) continue;
      errors.push_back((*place - q).norm());
    }
  }
  ASSERT_GE(errors.size(), static_cast<std::size_t>(tried * 9 / 10));
  std::sort(errors.begin(), errors.end());
  // Bilinear interpolation of waves of 6 px (up to 13 % of their height) is what remains.
  EXPECT_TRUE(errors[errors.size() / 2] <= 0.02) << errors[errors.size() / 2];
  EXPECT_TRUE(errors.back() <= 0.06) << errors.back();
}

TEST(RefinePoint, RefusesWhatItCannotPlace) {
  const Texture texture(5);
  const cv::Mat reference = draw(kWidth, kHeight, texture);
  const cv::Mat other = draw(kWidth, kHeight, Texture(6));
  const cv::Mat flat(kHeight, kWidth, CV_32F, cv::Scalar(0.5));
  const Vec2 p(100.5, 100.5);
  EXPECT_FALSE(refine_point(flat, flat, p, p, Mat2::Identity(), {}));
  EXPECT_FALSE(refine_point(reference, other, p, p, Mat2::Identity(), {}));
  EXPECT_FALSE(refine_point(reference, reference, {3.0, 3.0}, {3.0, 3.0}, Mat2::Identity(), {}));
  EXPECT_TRUE(refine_point(reference, reference, p, p, Mat2::Identity(), {}));
}

TEST(RefinePoint, APatchCorrelatesFullyWithItself) {
  constexpr double kRoundingPx = 1e-4;  // of sums in single precision
  const cv::Mat picture = draw(kWidth, kHeight, Texture(5));
  for (const double radius_px : {3.0, 6.0, 7.0, 12.0}) {  // discs of 25, 109, 145 and 437 pixels
    PointRefinementOptions options{.radius_px = radius_px};
    // Sums in single precision, of values of which the middle one's level is taken off.
    options.min_correlation = 1.0 - 1e-5;
    const PointRefiner refiner(options);
    for (double y = 40.3; y < kHeight - 40; y += 51.7)
      for (double x = 40.6; x < kWidth - 40; x += 51.7) {
        const Vec2 p(x, y);
        const auto sought = refiner.make_template(picture, p);
        ASSERT_TRUE(sought);
        const auto place = refiner(*sought, picture, p, Mat2::Identity());
        ASSERT_TRUE(place) << radius_px << ": " << p.transpose();
        EXPECT_TRUE((*place - p).norm() <= kRoundingPx);
      }
  }
}

TEST(RefinePoint, RefusesATemplateOfAnotherRadius) {
  const cv::Mat picture = draw(kWidth, kHeight, Texture(5));
  const Vec2 p(100.5, 100.5);
  const PointRefiner small({.radius_px = 7.0}), large({.radius_px = 12.0});
  const auto sought = small.make_template(picture, p);
  ASSERT_TRUE(sought);
  EXPECT_TRUE(small(*sought, picture, p, Mat2::Identity()));
  EXPECT_THROW(large(*sought, picture, p, Mat2::Identity()), Error);
}

TEST(Align, RecoversAffineHomographyAndCorrespondences) {
  const Texture texture(1);
  const Affine2 truth = similarity(0.05, 1.02, {9.0, -6.0});
  const Frame reference = frame_of(3, to_8bit(draw(kWidth, kHeight, texture)));
  const Frame moving = frame_of(4, to_8bit(moving_picture(texture, truth)));
  const auto pair = align(reference, moving, {}, 1);
  ASSERT_TRUE(pair);
  EXPECT_EQ(pair->reference, 3);
  EXPECT_EQ(pair->moving, 4);
  EXPECT_TRUE(pair->converged);
  EXPECT_GE(pair->inliers, 500);
  // The fit may end as soon as the MSE is below e^-9; 8-bit steps leave less than that.
  EXPECT_TRUE(pair->mse < AlignOptions().stop_mse);
  EXPECT_TRUE(worst_corner_px(pair->ref_from_mov_affine, truth) <= 0.5);
  ASSERT_EQ(pair->reference_px.size(), pair->moving_px.size());
  ASSERT_GE(pair->reference_px.size(), 400u);
  std::vector<double> errors;
  for (std::size_t i = 0; i < pair->reference_px.size(); ++i) {
    errors.push_back((truth * pair->moving_px[i].homogeneous() - pair->reference_px[i]).norm());
    const Vec2 h = (pair->ref_from_mov_homography * pair->moving_px[i].homogeneous()).hnormalized();
    EXPECT_TRUE((h - truth * pair->moving_px[i].homogeneous()).norm() <= 0.3);
  }
  std::sort(errors.begin(), errors.end());
  // Bilinear interpolation and 8-bit steps are what remains.
  EXPECT_TRUE(errors[errors.size() / 2] <= 0.04) << errors[errors.size() / 2];
  EXPECT_TRUE(errors[errors.size() * 99 / 100] <= 0.2) << errors[errors.size() * 99 / 100];
}

TEST(Align, FollowsGivenPoints) {
  const Texture texture(2);
  const Affine2 truth = similarity(-0.03, 1.0, {4.0, 5.0});
  AlignGuess guess;
  for (double y = 30; y < kHeight - 30; y += 11.7)
    for (double x = 30; x < kWidth - 30; x += 11.7) guess.reference_points.emplace_back(x, y);
  guess.reference_points.emplace_back(-5.0, 10.0);  // outside: never an inlier
  guess.affine = false;
  const auto pair = align(frame_of(0, to_8bit(draw(kWidth, kHeight, texture))),
                          frame_of(1, to_8bit(moving_picture(texture, truth))), {}, 1, guess);
  ASSERT_TRUE(pair);
  EXPECT_EQ(pair->iterations, 0);
  ASSERT_EQ(pair->point_index.size(), pair->moving_px.size());
  EXPECT_GE(pair->point_index.size(), guess.reference_points.size() * 7 / 10);
  for (std::size_t i = 0; i < pair->point_index.size(); ++i) {
    const Vec2& p = guess.reference_points[static_cast<std::size_t>(pair->point_index[i])];
    EXPECT_EQ(p, pair->reference_px[i]);
    EXPECT_TRUE((truth * pair->moving_px[i].homogeneous() - p).norm() <= 0.2);
  }
}

TEST(Align, AGuessOfTheFlowReachesFurther) {
  const Texture texture(2, 7.0, 40.0);  // without long waves, a large motion is ambiguous
  const Affine2 truth = similarity(0.0, 1.0, {75.0, 0.0});
  const Frame reference = frame_of(0, to_8bit(draw(kWidth, kHeight, texture)));
  const Frame moving = frame_of(1, to_8bit(moving_picture(texture, truth)));
  AlignGuess guess;
  guess.flow = cv::Mat(kHeight, kWidth, CV_32FC2, cv::Scalar(-72.0, 2.0));
  const auto pair = align(reference, moving, {}, 1, guess);
  ASSERT_TRUE(pair);
  EXPECT_TRUE((pair->ref_from_mov_affine.col(2) - Vec2(75.0, 0.0)).norm() <= 0.5);
}

TEST(Align, RefusesPicturesOfDifferentThings) {
  const Frame reference = frame_of(0, to_8bit(draw(kWidth, kHeight, Texture(1))));
  EXPECT_FALSE(align(reference, frame_of(1, to_8bit(draw(kWidth, kHeight, Texture(2)))), {}, 1));
  const cv::Mat gray(kHeight, kWidth, CV_8U, cv::Scalar(90));
  EXPECT_FALSE(align(reference, frame_of(1, gray), {}, 1));
  EXPECT_FALSE(align(frame_of(0, gray), frame_of(1, gray), {}, 1));
}

TEST(Align, StaysOffReflectionsAndInvalidPixels) {
  const Texture texture(1);
  Frame reference = frame_of(0, to_8bit(draw(kWidth, kHeight, texture)));
  Frame moving = frame_of(1, reference.gray);
  reference.reflection(cv::Rect(50, 50, 80, 60)).setTo(255);
  moving.valid(cv::Rect(200, 0, 120, 240)).setTo(0);
  const auto pair = align(reference, moving, {}, 1);
  ASSERT_TRUE(pair);
  for (std::size_t i = 0; i < pair->reference_px.size(); ++i) {
    EXPECT_FALSE(cv::Rect(50, 50, 80, 60)
                     .contains({static_cast<int>(pair->reference_px[i].x()),
                                static_cast<int>(pair->reference_px[i].y())}));
    EXPECT_TRUE(pair->moving_px[i].x() < 200.5);
  }
}

TEST(Align, SameForAnyNumberOfThreads) {
  const Texture texture(1);
  const Frame reference = frame_of(3, to_8bit(draw(kWidth, kHeight, texture)));
  const Frame moving =
      frame_of(4, to_8bit(moving_picture(texture, similarity(0.05, 1.02, {9, -6}))));
  const auto many = align(reference, moving, {}, 7);
  const int threads = cv::getNumThreads();
  cv::setNumThreads(1);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const auto single = align(reference, moving, {}, 7);
  cv::setNumThreads(threads);
  ASSERT_TRUE(many && single);
  EXPECT_EQ(many->ref_from_mov_homography, single->ref_from_mov_homography);
  EXPECT_EQ(many->ref_from_mov_affine, single->ref_from_mov_affine);
  EXPECT_EQ(many->reference_px, single->reference_px);
  EXPECT_EQ(many->moving_px, single->moving_px);
}

}  // namespace
}  // namespace rugae
