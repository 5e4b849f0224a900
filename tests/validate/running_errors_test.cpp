#include "validate/running_errors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/random.h"

namespace rugae {
namespace {

constexpr double kMedian = 1e-3;  // of itself: the width of a bin

TEST(RunningErrors, AreTheStatisticsOfTheList) {
  std::vector<double> list;
  for (std::uint64_t i = 0; i < 1001; ++i) {
    const auto u = random_uniform(1, Purpose::test, 0, i);
    list.push_back(std::pow(10.0, 4.0 * u[0] - 2.0));  // 0.01 to 100
  }
  for (const std::size_t count : {std::size_t{1}, std::size_t{2}, std::size_t{1000}, list.size()}) {
    const std::vector<double> part(list.begin(), list.begin() + static_cast<long>(count));
    RunningErrors running({1.0, 3.0});
    std::size_t below_1 = 0, below_3 = 0;
    for (const double e : part) {
      running.add(e);
      below_1 += e < 1.0 ? 1 : 0;
      below_3 += e < 3.0 ? 1 : 0;
    }
    const ErrorStats expected = error_stats(part), found = running.stats();
    EXPECT_EQ(found.count, count);
    EXPECT_DOUBLE_EQ(found.mean, expected.mean);
    EXPECT_DOUBLE_EQ(found.rmse, expected.rmse);
    EXPECT_EQ(found.max, expected.max);
    EXPECT_NEAR(found.median, expected.median, kMedian * expected.median) << count;
    EXPECT_DOUBLE_EQ(running.share_below(0), static_cast<double>(below_1) / count);
    EXPECT_DOUBLE_EQ(running.share_below(1), static_cast<double>(below_3) / count);
  }
}

TEST(RunningErrors, ZerosAndFarOutliersAreCounted) {
  RunningErrors running({1.0});
  for (const double e : {0.0, 0.0, 0.0, 1e9, 2e9}) running.add(e);
  EXPECT_EQ(running.stats().median, 0.0);
  EXPECT_EQ(running.stats().max, 2e9);
  EXPECT_DOUBLE_EQ(running.share_below(0), 0.6);
}

TEST(RunningErrors, ANanIsNeverSkipped) {
  RunningErrors running({1.0});
  running.add(0.5);
  running.add(std::numeric_limits<double>::quiet_NaN());
  const ErrorStats stats = running.stats();
  EXPECT_EQ(stats.count, 2u);
  EXPECT_TRUE(std::isnan(stats.mean) && std::isnan(stats.rmse) && std::isnan(stats.median) &&
              std::isnan(stats.max));
  EXPECT_DOUBLE_EQ(running.share_below(0), 0.5);
}

TEST(RunningErrors, NothingCountsAsNothing) { EXPECT_EQ(RunningErrors().stats().count, 0u); }

}  // namespace
}  // namespace rugae
