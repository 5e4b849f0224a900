#include "studies/gates.h"

#include <gtest/gtest.h>

#include <limits>

namespace rugae {
namespace {

CellResult cell(const std::string& trajectory, const nlohmann::json& metrics) {
  CellResult result;
  result.cell = {"misumi-v5506", trajectory, "paper"};
  result.metrics = metrics;
  return result;
}

const nlohmann::json kMetrics = {
    {"trajectory", {{"ate_sim3_rmse_mm", 52.1}, {"ate_se3_rmse_mm", nullptr}}},
    {"tracking", {{"tracked_share", 0.9}}}};

Gate gate(const std::string& metric, std::optional<double> above, std::optional<double> below) {
  Gate gate;
  gate.metric = metric;
  gate.above = above;
  gate.below = below;
  gate.reason = "because";
  return gate;
}

TEST(Gates, BoundsAreHeld) {
  const std::vector<CellResult> cells{cell("1", kMetrics)};
  const auto holds = [&](std::optional<double> above, std::optional<double> below) {
    return hold_gates({gate("trajectory.ate_sim3_rmse_mm", above, below)}, cells)[0].passed;
  };
  EXPECT_TRUE(holds({}, 52.2));
  EXPECT_FALSE(holds({}, 52.1));
  EXPECT_TRUE(holds(52.0, {}));
  EXPECT_FALSE(holds(52.1, {}));
  EXPECT_TRUE(holds(50.0, 60.0));
  EXPECT_FALSE(holds(53.0, 60.0));
}

TEST(Gates, TheLineNamesCellMetricNumberBoundAndReason) {
  const auto outcome =
      hold_gates({gate("trajectory.ate_sim3_rmse_mm", {}, 41.7)}, {cell("1", kMetrics)});
  EXPECT_EQ(outcome[0].line(),
            "misumi-v5506, trajectory 1, paper: trajectory.ate_sim3_rmse_mm is 52.1, expected "
            "below 41.7: because");
}

TEST(Gates, WhatWasNotMeasuredFails) {
  nlohmann::json nan = kMetrics;
  nan["trajectory"]["ate_sim3_rmse_mm"] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(
      hold_gates({gate("trajectory.ate_sim3_rmse_mm", {}, 1e9)}, {cell("1", nan)})[0].passed);
  const auto null =
      hold_gates({gate("trajectory.ate_se3_rmse_mm", {}, 1e9)}, {cell("1", kMetrics)});
  EXPECT_FALSE(null[0].passed);
  EXPECT_EQ(null[0].found, "not measured");
}

TEST(Gates, AMisspeltMetricFailsAndOffersTheNearest) {
  const auto outcome = hold_gates({gate("tracking.track_share", 0.5, {})}, {cell("1", kMetrics)});
  EXPECT_FALSE(outcome[0].passed);
  EXPECT_EQ(outcome[0].found, "no such metric; did you mean 'tracking.tracked_share'?");
}

TEST(Gates, AGateMayNameSeveral) {
  Gate some = gate("tracking.tracked_share", 0.5, {});
  some.trajectory = {"1", "3"};
  const auto outcomes =
      hold_gates({some}, {cell("1", kMetrics), cell("2", kMetrics), cell("3", kMetrics)});
  ASSERT_EQ(outcomes.size(), 2u);
  EXPECT_EQ(outcomes[0].cell, "misumi-v5506, trajectory 1, paper");
  EXPECT_EQ(outcomes[1].cell, "misumi-v5506, trajectory 3, paper");
}

TEST(Gates, AGateNamesItsCells) {
  Gate second = gate("tracking.tracked_share", 0.5, {});
  second.trajectory = {"2"};
  const std::vector<CellResult> cells{cell("1", kMetrics), cell("2", kMetrics)};
  const auto outcomes = hold_gates({second}, cells);
  ASSERT_EQ(outcomes.size(), 1u);
  EXPECT_EQ(outcomes[0].cell, "misumi-v5506, trajectory 2, paper");
  second.trajectory = {"7"};
  const auto none = hold_gates({second}, cells);
  ASSERT_EQ(none.size(), 1u);
  EXPECT_FALSE(none[0].passed);
  EXPECT_EQ(none[0].found, "in no cell of the study");
}

}  // namespace
}  // namespace rugae
