#include "cameras/lens_difference.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/message_of.h"

namespace rugae {
namespace {

Lens lens_of(LensModel model) {
  Lens lens;
  lens.model = model;
  lens.width = 640;
  lens.height = 480;
  lens.fx = lens.fy = 320.0;
  lens.cx = 320.0;
  lens.cy = 240.0;
  return lens;
}

TEST(LensDifference, ALensIsItself) {
  for (const LensModel model : {LensModel::brown_conrady, LensModel::kannala_brandt}) {
    const Lens lens = lens_of(model);
    const LensDifference same = compare(lens, lens);
    EXPECT_EQ(same.focal_share, 0.0);
    EXPECT_EQ(same.principal_point_px, 0.0);
    EXPECT_LE(same.projection_rms_px, 1e-9);
    EXPECT_LE(same.projection_corner_px, 1e-9);
  }
}

TEST(LensDifference, AMovedPrincipalPointMovesEveryPixel) {
  const Lens truth = lens_of(LensModel::brown_conrady);
  Lens found = truth;
  found.cx += 3.0;
  found.cy -= 4.0;
  const LensDifference d = compare(found, truth);
  EXPECT_NEAR(d.principal_point_px, 5.0, 1e-12);
  EXPECT_NEAR(d.projection_rms_px, 5.0, 1e-9);
  EXPECT_NEAR(d.projection_corner_px, 5.0, 1e-9);
  EXPECT_EQ(d.focal_share, 0.0);
}

// A pixel at distance r from the centre moves by r / 100; the mean of r^2 over the grid's 33 x 33
// points is (w^2 + h^2) / 12 (1 + 2 / 32).
TEST(LensDifference, ALongerFocalLengthMovesPixelsByTheirRadius) {
  const Lens truth = lens_of(LensModel::brown_conrady);
  Lens found = truth;
  found.fx *= 1.01;
  found.fy *= 1.01;
  const LensDifference d = compare(found, truth);
  EXPECT_NEAR(d.focal_share, 0.01, 1e-12);
  EXPECT_NEAR(d.projection_corner_px, 0.01 * 400.0, 1e-9);
  EXPECT_NEAR(d.projection_rms_px, 0.01 * std::sqrt(800.0 * 800.0 / 12.0 * (1.0 + 2.0 / 32.0)),
              1e-9);
}

TEST(LensDifference, OnlyTheFieldStopsInsideCounts) {
  Lens truth = lens_of(LensModel::brown_conrady);
  truth.stop = {StopShape::circle, 1.0};  // 240 px
  Lens found = truth;
  found.fx *= 1.01;
  found.fy *= 1.01;
  const LensDifference d = compare(found, truth);
  EXPECT_NEAR(d.projection_corner_px, 2.4, 1e-6);
  EXPECT_LT(d.projection_rms_px, 2.4);
}

TEST(LensDifference, OtherSizesAreRefused) {
  Lens truth = lens_of(LensModel::brown_conrady), found = truth;
  found.width = 320;
  EXPECT_EQ(message_of([&] { compare(found, truth); }),
            "lenses of 320 x 480 and 640 x 480 px cannot be compared");
}

TEST(PerturbedLens, ScalesFocalLengthAndDistortionAlone) {
  Lens lens = lens_of(LensModel::brown_conrady);
  lens.k1 = -0.2;
  lens.k2 = 0.03;
  lens.p1 = 1e-3;
  const Lens wrong = perturbed(lens, 0.1);
  EXPECT_NEAR(wrong.fx, 352.0, 1e-9);
  EXPECT_NEAR(wrong.fy, 352.0, 1e-9);
  EXPECT_NEAR(wrong.k1, -0.22, 1e-12);
  EXPECT_NEAR(wrong.k2, 0.033, 1e-12);
  EXPECT_NEAR(wrong.p1, 1.1e-3, 1e-12);
  EXPECT_EQ(wrong.cx, lens.cx);
  EXPECT_EQ(wrong.cy, lens.cy);
  EXPECT_EQ(lens_yaml(perturbed(lens, 0.0), ""), lens_yaml(lens, ""));
  EXPECT_NEAR(compare(wrong, lens).focal_share, 0.1, 1e-12);
}

TEST(PerturbedLens, AnErrorGrowsWithItsShare) {
  const Lens lens = load_camera("misumi-v5506").lens;
  double last = 0.0;
  for (const double share : {0.001, 0.01, 0.05, 0.1}) {
    const double rms = compare(perturbed(lens, share), lens).projection_rms_px;
    EXPECT_GT(rms, last);
    last = rms;
  }
  EXPECT_EQ(message_of([&] { perturbed(lens, -1.0); }),
            "a lens cannot be wrong by -1, expected above -1");
}

// With k1 alone a ray at r lands at r (1 + k1 r^2), at most at (2/3) / sqrt(-3 k1): 1.72 for the
// lens, whose corners are at 400 / 320, and 2.43 with half of k1, where they are at 400 / 160.
TEST(PerturbedLens, WhatProjectsNoWholePictureIsRefused) {
  Lens lens = lens_of(LensModel::brown_conrady);
  lens.k1 = -0.05;
  EXPECT_EQ(message_of([&] { perturbed(lens, -0.5); }),
            "a lens wrong by -0.5: the distortion has no inverse at the image corner (0, 0)");
}

}  // namespace
}  // namespace rugae
