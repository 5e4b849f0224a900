#include "core/progress.h"

#include <gtest/gtest.h>

#include <thread>

#include "core/check.h"

namespace rugae {
namespace {

TEST(Progress, StagesThatTookTurnsShareTheirTime) {
  Progress progress(Progress::Output::silent);
  progress.begin("mosaics", 2);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  progress.step(2);
  progress.end();
  const double whole_s = progress.stages().back().seconds;
  progress.split_off("shading", 0.005);
  ASSERT_EQ(progress.stages().size(), 2u);
  EXPECT_EQ(progress.stages()[0].name, "mosaics");
  EXPECT_EQ(progress.stages()[1].name, "shading");
  EXPECT_EQ(progress.stages()[1].seconds, 0.005);
  EXPECT_DOUBLE_EQ(progress.stages()[0].seconds + 0.005, whole_s);
  EXPECT_GT(progress.stages()[1].peak_rss_mb, 0.0);
}

TEST(Progress, NothingIsSplitOffAStageThatRuns) {
  Progress progress(Progress::Output::silent);
  EXPECT_THROW(progress.split_off("shading", 1.0), Error);
  progress.begin("mosaics");
  EXPECT_THROW(progress.split_off("shading", 1.0), Error);
}

}  // namespace
}  // namespace rugae
