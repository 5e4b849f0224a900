#include "studies/summary.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/check.h"
#include "studies/published.h"
#include "studies/report_parts.h"

namespace rugae {
namespace {

CellResult cell(const std::string& trajectory, const std::string& setting, double ate_mm,
                std::uint64_t seed = 1, double tracked = 1.0) {
  CellResult result;
  result.cell = {"misumi-v5506", trajectory, "paper", {{"strength", setting}}, seed};
  result.metrics = {{"trajectory", {{"ate_mm", ate_mm}}},
                    {"tracking", {{"tracked_share", tracked}}}};
  if (!std::isfinite(ate_mm)) result.metrics = {{"failed", "no light"}};
  return result;
}

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

TEST(Summary, ATableIsTheMeanOverAllElseBesideThePublished) {
  SummarySpecs specs;
  specs.tables = {{"ATE", "trajectory.ate_mm", "cm", 0.1, "trajectory", "camera", "ate"}};
  const Summary summary = summarise(specs, {cell("1", "0", 10, 1), cell("1", "0", 14, 2),
                                            cell("2", "0", 3), cell("2", "1", kNone)});
  const SummaryTable& table = summary.tables[0];
  EXPECT_EQ(table.rows, (std::vector<std::string>{"1", "2"}));
  EXPECT_EQ(table.columns, (std::vector<std::string>{"misumi-v5506"}));
  EXPECT_DOUBLE_EQ(table.entries[0][0].ours.mean, 1.2);
  // Two values 0.4 apart: their mean is known to t(1) * 0.2.
  EXPECT_NEAR(table.entries[0][0].ours.half_width, 12.7062 * 0.2, 1e-3);
  EXPECT_DOUBLE_EQ(table.entries[0][0].published.value(), 41.7);
  EXPECT_EQ(table.entries[1][0].failed, 1);
  EXPECT_EQ(table.entries[1][0].ours.count, 1);
  EXPECT_EQ(
      table_csv(table),
      "trajectory,camera,mean,half_width_95,cells,failed,published,ratio\n" +
          fmt::format("1,misumi-v5506,{},{},2,0,41.7,{}\n", table.entries[0][0].ours.mean,
                      table.entries[0][0].ours.half_width, table.entries[0][0].ours.mean / 41.7) +
          fmt::format("2,misumi-v5506,{},,1,1,43.2,{}\n", 0.1 * 3, 0.1 * 3 / 43.2));
}

TEST(Summary, ATableMayBeOfOneMethod) {
  SummarySpecs specs;
  specs.tables = {{"ATE", "trajectory.ate_mm", "mm", 1.0, "trajectory", "camera", "", "dense"}};
  std::vector<CellResult> cells = {cell("1", "0", 10), cell("1", "0", 2)};
  cells[1].cell.method = "dense";
  const TableEntry entry = summarise(specs, cells).tables[0].entries[0][0];
  EXPECT_EQ(entry.ours.count, 1);
  EXPECT_EQ(entry.ours.mean, 2.0);
}

TEST(Summary, ACurveBreaksWhereTheErrorTriplesOrFramesAreLost) {
  SummarySpecs specs;
  specs.curves = {{"ATE", "trajectory.ate_mm", "mm", 1.0, "strength", "trajectory"}};
  const Summary summary = summarise(
      specs, {cell("1", "0", 1), cell("1", "2", 2.9), cell("1", "4", 3.1), cell("2", "0", 1),
              cell("2", "2", 1, 1, 0.5), cell("2", "4", 1), cell("3", "0", 1), cell("3", "2", 1),
              cell("3", "4", kNone), cell("4", "0", 1), cell("4", "2", 2), cell("4", "4", 3)});
  using Between = std::optional<std::pair<double, double>>;
  const auto& lines = summary.curves[0].lines;
  ASSERT_EQ(lines.size(), 4u);
  EXPECT_EQ(lines[0].x, (std::vector<double>{0, 2, 4}));
  EXPECT_EQ(lines[0].breaks_between, Between({2, 4}));
  EXPECT_EQ(lines[1].breaks_between, Between({0, 2}));
  EXPECT_EQ(lines[2].breaks_between, Between({2, 4}));
  EXPECT_EQ(lines[3].breaks_between, Between());
}

// Twice as large each time, with and without spread; pairs are formed over all else.
TEST(Summary, AFindingIsARatioWithAnInterval) {
  SummarySpecs specs;
  specs.findings = {
      {"more is worse", "trajectory.ate_mm", {"strength", "1"}, {"strength", "0"}},
      {"less is worse", "trajectory.ate_mm", {"strength", "0"}, {"strength", "1"}},
      {"trajectories", "trajectory.ate_mm", {"trajectory", "1"}, {"trajectory", "2"}}};
  const Summary summary = summarise(
      specs, {cell("1", "0", 1), cell("1", "1", 2.2), cell("2", "0", 3), cell("2", "1", 6),
              cell("3", "0", 5), cell("3", "1", 9.5), cell("4", "0", 5), cell("4", "1", kNone)});
  const SummaryFinding& more = summary.findings[0];
  EXPECT_EQ(more.pairs, 3);
  EXPECT_EQ(more.failed, 1);
  EXPECT_NEAR(more.ratio, std::cbrt(2.2 * 2.0 * 1.9), 1e-12);
  EXPECT_EQ(more.verdict(), "confirmed");
  EXPECT_TRUE(more.low > 1.0 && more.low < more.ratio && more.high > more.ratio);
  const SummaryFinding& less = summary.findings[1];
  EXPECT_EQ(less.verdict(), "refuted");
  EXPECT_NEAR(less.ratio * more.ratio, 1.0, 1e-12);
  // One pair alone has no interval.
  EXPECT_EQ(summarise(specs, {cell("1", "0", 1), cell("1", "1", 2)}).findings[0].verdict(), "open");
}

TEST(Summary, WhatIsOfTimesIsNotAmongTheResults) {
  SummarySpecs specs;
  specs.tables = {{"T", "time.reconstruct_s", "s", 1.0, "trajectory", "camera", ""},
                  {"A", "trajectory.ate_mm", "mm", 1.0, "trajectory", "camera", ""}};
  const auto json = to_json(summarise(specs, {cell("1", "0", 1)}));
  ASSERT_EQ(json.at("tables").size(), 1u);
  EXPECT_EQ(json.at("tables")[0].at("rows").at("1").at("misumi-v5506").at("mean"), 1.0);
}

TEST(Summary, ThePageHasOursAndThePublished) {
  SummarySpecs specs;
  specs.tables = {{"ATE", "trajectory.ate_mm", "mm", 1.0, "trajectory", "camera", "ate"}};
  specs.findings = {{"more is worse", "trajectory.ate_mm", {"strength", "1"}, {"strength", "0"}}};
  const std::string page = summary_part(summarise(specs, {cell("1", "0", 4.17)}));
  EXPECT_NE(page.find("published 41.7, ratio 0.10"), std::string::npos) << page;
  EXPECT_NE(page.find("Misumi-II"), std::string::npos);
  EXPECT_EQ(page.find("nan"), std::string::npos);
  EXPECT_EQ(summary_part({}), "");
}

TEST(Summary, ThePageKeepsTheDecimalsOfAnAxis) {
  SummarySpecs specs;
  specs.tables = {{"ATE", "trajectory.ate_mm", "mm", 1.0, "strength", "trajectory", ""}};
  const std::string page = summary_part(
      summarise(specs, {cell("paths/slow.yaml", "0.25", 1), cell("paths/slow.yaml", "0.5", 2)}));
  EXPECT_NE(page.find(">0.25<"), std::string::npos) << page;
  EXPECT_NE(page.find(">0.5<"), std::string::npos) << page;
  EXPECT_NE(page.find(">slow<"), std::string::npos) << page;  // trajectories by their names
}

TEST(Published, NumbersOfThePaper) {
  EXPECT_DOUBLE_EQ(published("ate", "6", "awaiba-naneye").value(), 87.3);
  // By the names of studies/presets/preprocessing.yaml.
  EXPECT_DOUBLE_EQ(published("map_preprocessing", "1", "NPR").value(), 54.5);
  EXPECT_DOUBLE_EQ(published("ate_preprocessing", "1", "NPR").value(), 41.2);
  EXPECT_DOUBLE_EQ(published("ate_preprocessing", "6", "RSPM+RUD+DV").value(), 51.2);
  EXPECT_EQ(published("features", "ORB", "potensic-mini"), 0.35);
  EXPECT_EQ(published("map", "4", "potensic-mini"), std::nullopt);
  EXPECT_EQ(published("none", "1", "misumi-v5506"), std::nullopt);
  EXPECT_EQ(number_in("1.5"), 1.5);
  EXPECT_EQ(number_in("1.5 mm"), std::nullopt);
  EXPECT_EQ(number_in("nan"), std::nullopt);
}

}  // namespace
}  // namespace rugae
