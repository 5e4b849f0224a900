// What is held of frames.

#include "recon/cache.h"

#include <vector>

#include "recon/preprocess/preprocess.h"
#include "tests/recon/image_sequence.h"

namespace rugae {
namespace {

TEST(Cache, HoldsWhatWasAskedForLast) {
  Cache<int> cache(2);
  std::vector<int> made;
  const auto get = [&](int index) {
    return cache.get(index, [&] {
      made.push_back(index);
      return 10 * index;
    });
  };
  for (const int index : {1, 2, 1, 3, 1}) EXPECT_EQ(get(index), 10 * index);
  EXPECT_EQ(made, (std::vector<int>{1, 2, 3}));
  EXPECT_EQ(get(2), 20);  // gone when 3 came
  EXPECT_EQ(made.size(), 4u);
  EXPECT_EQ(get(1), 10);  // held, since it was asked for after 3
  EXPECT_EQ(made.size(), 4u);
  cache.clear();
  EXPECT_EQ(get(1), 10);
  EXPECT_EQ(made.size(), 5u);
}

using HeldFrames = testing::ImageSequence;

bool same(const cv::Mat& a, const cv::Mat& b) { return cv::norm(a, b, cv::NORM_INF) == 0.0; }

// Whichever call makes an image, and however often.
TEST_F(HeldFrames, AreTheSameHoweverTheyAreAskedFor) {
  for (const bool suppress : {false, true}) {
    PreprocessOptions options;
    options.reflections.suppress_for_pose = suppress;
    const FrameSource frames = source({4.0, 4.0}, options);
    const cv::Mat gray = frames.gray(1).clone();
    const Frame pose = frames.pose_frame(1), whole = frames.frame(1);
    EXPECT_TRUE(same(pose.gray, gray) && same(whole.gray, gray));
    EXPECT_TRUE(same(pose.reflection, whole.reflection));
    EXPECT_TRUE(same(frames.map_frame(1).map_bgr, whole.map_bgr));
    EXPECT_EQ(frames.gray(1).data, pose.gray.data);  // held
    const unsigned char* const before = pose.gray.data;
    frames.release();
    const Frame again = frames.pose_frame(1);  // while `pose` still has the old one
    EXPECT_NE(again.gray.data, before);
    EXPECT_TRUE(same(again.gray, gray) && same(again.reflection, pose.reflection));
    EXPECT_FALSE(same(frames.gray(2), gray));
  }
}

}  // namespace
}  // namespace rugae
