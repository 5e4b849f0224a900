#include "validate/mask_error.h"

#include <gtest/gtest.h>

#include "core/check.h"

namespace rugae {
namespace {

// A row of pixels.
cv::Mat mask(std::vector<unsigned char> values) { return cv::Mat(values, true).reshape(1, 1); }

TEST(MaskError, CountsEveryPixelOnce) {
  const cv::Mat found = mask({255, 1, 0, 0, 255, 0, 0, 0, 0, 0}),
                truly = mask({2, 255, 255, 0, 0, 0, 0, 0, 0, 0});
  const MaskError error = mask_error(found, truly);
  EXPECT_EQ(error, (MaskError{2, 1, 1, 6}));
  EXPECT_EQ(error.pixels(), 10u);
  EXPECT_DOUBLE_EQ(*error.precision(), 2.0 / 3.0);
  EXPECT_DOUBLE_EQ(*error.recall(), 2.0 / 3.0);
  EXPECT_DOUBLE_EQ(*error.f1(), 2.0 / 3.0);
  EXPECT_DOUBLE_EQ(*error.iou(), 0.5);
}

TEST(MaskError, ScoresAreTheDefinitions) {
  const MaskError error{3, 1, 6, 10};
  const double precision = 3.0 / 4.0, recall = 3.0 / 9.0;
  EXPECT_DOUBLE_EQ(*error.precision(), precision);
  EXPECT_DOUBLE_EQ(*error.recall(), recall);
  EXPECT_DOUBLE_EQ(*error.f1(), 2.0 * precision * recall / (precision + recall));
  EXPECT_DOUBLE_EQ(*error.iou(), 3.0 / 10.0);
}

TEST(MaskError, WhatHasNoMeaningIsEmpty) {
  const cv::Mat some = mask({255, 0, 0}), none = mask({0, 0, 0});
  const MaskError missed = mask_error(none, some), invented = mask_error(some, none),
                  nothing = mask_error(none, none), right = mask_error(some, some);
  EXPECT_FALSE(missed.precision());
  EXPECT_EQ(missed.recall(), 0.0);
  EXPECT_EQ(missed.f1(), 0.0);
  EXPECT_EQ(missed.iou(), 0.0);
  EXPECT_EQ(invented.precision(), 0.0);
  EXPECT_FALSE(invented.recall());
  EXPECT_FALSE(nothing.precision() || nothing.recall() || nothing.f1() || nothing.iou());
  EXPECT_EQ(right.precision(), 1.0);
  EXPECT_EQ(right.recall(), 1.0);
  EXPECT_EQ(right.f1(), 1.0);
  EXPECT_EQ(right.iou(), 1.0);
}

TEST(MaskError, OnlyWhereItIsAsked) {
  const MaskError error =
      mask_error(mask({255, 255, 0, 0}), mask({255, 0, 255, 0}), mask({255, 0, 1, 0}));
  EXPECT_EQ(error, (MaskError{1, 0, 1, 0}));
}

TEST(MaskError, AddsUp) {
  MaskError sum{1, 2, 3, 4};
  sum += {10, 20, 30, 40};
  EXPECT_EQ(sum, (MaskError{11, 22, 33, 44}));
}

TEST(MaskError, MasksOfOtherSizesAndTypesAreErrors) {
  EXPECT_THROW(mask_error(mask({1, 2}), mask({1, 2, 3})), Error);
  EXPECT_THROW(mask_error(mask({1, 2}), mask({1, 2}), mask({1})), Error);
  EXPECT_THROW(mask_error(mask({1, 2}), cv::Mat(1, 2, CV_32F, cv::Scalar(0))), Error);
}

}  // namespace
}  // namespace rugae
