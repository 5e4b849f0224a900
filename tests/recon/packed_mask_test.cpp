#include "recon/preprocess/packed_mask.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "core/check.h"
#include "core/random.h"

namespace rugae {
namespace {

TEST(PackedMask, ComesBackAsItWas) {
  for (const int cols : {1, 7, 8, 9, 64, 101}) {
    cv::Mat mask(13, cols, CV_8U);
    for (int y = 0; y < mask.rows; ++y)
      for (int x = 0; x < cols; ++x)
        mask.at<unsigned char>(y, x) = random_words(1, Purpose::test, static_cast<std::uint32_t>(y),
                                                    static_cast<std::uint64_t>(x))[0] &
                                               1
                                           ? 255
                                           : 0;
    const cv::Mat packed = packed_mask(mask);
    EXPECT_EQ(packed.total(), static_cast<std::size_t>(13 * ((cols + 7) / 8)));
    EXPECT_EQ(cv::norm(unpacked_mask(packed, cols), mask, cv::NORM_INF), 0.0) << cols;
  }
}

TEST(PackedMask, OtherPicturesAreErrors) {
  EXPECT_THROW(packed_mask(cv::Mat(4, 4, CV_32F)), Error);
  EXPECT_THROW(unpacked_mask(cv::Mat(4, 2, CV_8U), 17), Error);
}

}  // namespace
}  // namespace rugae
