#include "dataset/png_encode.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "core/random.h"

namespace rugae {
namespace {

cv::Mat noise(int width, int height, int type) {
  cv::Mat image(height, width, type);
  const std::size_t row_bytes = image.elemSize() * static_cast<std::size_t>(width);
  for (int y = 0; y < height; ++y)
    for (std::size_t i = 0; i < row_bytes; ++i)
      image.ptr(y)[i] = static_cast<unsigned char>(
          random_words(5, Purpose::test, static_cast<std::uint32_t>(y), i)[0]);
  return image;
}

// libpng, inside OpenCV, checks every checksum and refuses what breaks the standard.
TEST(PngEncode, AnotherDecoderGivesEveryBitBack) {
  for (const int type : {CV_8UC1, CV_8UC3, CV_16UC1, CV_16UC3}) {
    for (const cv::Size size :
         {cv::Size(1, 1), cv::Size(3, 2), cv::Size(64, 48), cv::Size(37, 1)}) {
      const cv::Mat image = noise(size.width, size.height, type);
      const cv::Mat kept = image.clone();
      const std::string bytes = encode_png(image);
      EXPECT_EQ(cv::norm(kept, image, cv::NORM_INF), 0.0);
      const cv::Mat back = cv::imdecode(
          cv::Mat(1, static_cast<int>(bytes.size()), CV_8U, const_cast<char*>(bytes.data())),
          cv::IMREAD_UNCHANGED);
      ASSERT_EQ(back.type(), type);
      ASSERT_EQ(back.size(), size);
      EXPECT_EQ(cv::norm(back, image, cv::NORM_INF), 0.0);
    }
  }
}

TEST(PngEncode, RowsOfALargerImageAreFound) {
  const cv::Mat large = noise(40, 30, CV_8UC3), part = large(cv::Rect(5, 7, 20, 11));
  EXPECT_EQ(encode_png(part), encode_png(part.clone()));
}

}  // namespace
}  // namespace rugae
