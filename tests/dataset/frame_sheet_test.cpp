#include "dataset/frame_sheet.h"

#include <gtest/gtest.h>

#include "dataset/colours.h"
#include "plane_dataset.h"
#include "tests/message_of.h"

namespace rugae {
namespace {

TEST(FrameSheet, HoldsEveryLabelOfTheFrame) {
  const testing::TemporaryFolder folder("sheet");
  const testing::PlaneWorld world;
  world.write(folder.path() / "plane");
  const auto captions = [&](int frame) {
    std::vector<std::string> names;
    for (const SheetTile& tile : label_tiles(folder.path() / "plane", frame)) {
      EXPECT_EQ(tile.bgr.size(), cv::Size(64, 48));
      EXPECT_EQ(tile.bgr.type(), CV_8UC3);
      names.push_back(tile.caption);
    }
    return names;
  };
  EXPECT_EQ(captions(0), (std::vector<std::string>{"depth", "normals", "masks", "flow"}));
  EXPECT_EQ(captions(4), (std::vector<std::string>{"depth", "normals", "masks"}));
  EXPECT_EQ(message_of([&] { label_tiles(folder.path() / "plane", 5); }),
            (folder.path() / "plane").string() + ": frame 5, expected 0 to 4");
}

TEST(FrameSheet, PlacesTilesRowByRow) {
  const cv::Mat red(30, 40, CV_8UC3, cv::Scalar(0, 0, 255)), tall(60, 20, CV_8UC3, cv::Scalar(9));
  const cv::Mat page = sheet({{"", red}, {"", red}, {"", tall}}, 2, 80);
  // Two columns of 80 x 60 px, 8 px apart; 26 px for the caption below each.
  ASSERT_EQ(page.size(), cv::Size(8 + 2 * 88, 8 + 2 * 94));
  EXPECT_EQ(page.at<cv::Vec3b>(8, 8), cv::Vec3b(0, 0, 255));
  EXPECT_EQ(page.at<cv::Vec3b>(67, 175), cv::Vec3b(0, 0, 255));
  EXPECT_NE(page.at<cv::Vec3b>(7, 8), cv::Vec3b(0, 0, 255));
  EXPECT_NE(page.at<cv::Vec3b>(68, 8), cv::Vec3b(0, 0, 255));
  EXPECT_EQ(page.at<cv::Vec3b>(102 + 30, 48), cv::Vec3b(9, 0, 0));  // in the middle of its place
  EXPECT_NE(page.at<cv::Vec3b>(102 + 30, 20), cv::Vec3b(9, 0, 0));
}

}  // namespace
}  // namespace rugae
