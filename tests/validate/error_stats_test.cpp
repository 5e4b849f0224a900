#include "validate/error_stats.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace rugae {
namespace {

TEST(ErrorStats, KnownList) {
  const ErrorStats stats = error_stats({3.0, 4.0, 0.0, 5.0});
  EXPECT_DOUBLE_EQ(stats.rmse, std::sqrt(50.0 / 4.0));
  EXPECT_DOUBLE_EQ(stats.mean, 3.0);
  EXPECT_DOUBLE_EQ(stats.median, 3.5);
  EXPECT_DOUBLE_EQ(stats.max, 5.0);
  EXPECT_EQ(stats.count, 4u);
  EXPECT_DOUBLE_EQ(median({9.0, 1.0, 5.0}), 5.0);
}

TEST(ErrorStats, NothingCountsAsNothing) { EXPECT_EQ(error_stats({}).count, 0u); }

TEST(ErrorStats, ANanIsNeverSkipped) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const auto& list : {std::vector<double>{nan, 1.0, 2.0}, {1.0, nan, 2.0}, {1.0, 2.0, nan}}) {
    const ErrorStats stats = error_stats(list);
    EXPECT_TRUE(std::isnan(stats.rmse) && std::isnan(stats.mean) && std::isnan(stats.median) &&
                std::isnan(stats.max));
    EXPECT_TRUE(std::isnan(median(list)));
  }
}

}  // namespace
}  // namespace rugae
