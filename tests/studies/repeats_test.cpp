#include "studies/repeats.h"

#include <gtest/gtest.h>

#include <cmath>

#include "studies/junit.h"
#include "studies/tables.h"

namespace rugae {
namespace {

// Published two-sided 95 % values, to the digits of the tables.
TEST(Repeats, StudentsTIsThatOfTheTables) {
  constexpr double kTable = 5e-4;  // half a digit of the tables
  EXPECT_NEAR(student_t_95(1), 12.706, kTable);
  EXPECT_NEAR(student_t_95(2), 4.303, kTable);
  EXPECT_NEAR(student_t_95(3), 3.182, kTable);
  EXPECT_NEAR(student_t_95(4), 2.776, kTable);
  EXPECT_NEAR(student_t_95(9), 2.262, kTable);
  EXPECT_NEAR(student_t_95(30), 2.042, kTable);
  EXPECT_NEAR(student_t_95(100000), 1.960, kTable);
}

TEST(Repeats, MeanAndInterval) {
  const Repeats r = repeats_of({1.0, 2.0, 3.0, 4.0});
  EXPECT_EQ(r.count, 4);
  EXPECT_NEAR(r.mean, 2.5, 1e-12);
  EXPECT_NEAR(r.half_width, 3.1824 * std::sqrt(5.0 / 3.0 / 4.0), 1e-3);
  EXPECT_EQ(repeats_of({7.0}).mean, 7.0);
  EXPECT_TRUE(std::isnan(repeats_of({7.0}).half_width));
  EXPECT_TRUE(std::isnan(repeats_of({}).mean));
  EXPECT_TRUE(std::isnan(repeats_of({1.0, std::nan("")}).mean));
}

CellResult cell(int variant, std::uint64_t seed, double ate_mm) {
  CellResult result;
  result.cell = {"cam", "1",  "paper", {{"frames", variant == 0 ? "12" : "24"}},
                 seed,  true, variant};
  result.metrics = {{"trajectory", {{"ate_mm", ate_mm}}},
                    {"time", {{"seconds", 3.0}}},
                    {"simulation", {{"frames", 12}, {"seconds", 4.0}}}};
  return result;
}

TEST(Repeats, SeedsOfASettingAreOneRow) {
  const std::string csv = repeats_csv({cell(0, 1, 1.0), cell(0, 2, 3.0), cell(1, 1, 5.0)});
  EXPECT_EQ(csv.substr(0, csv.find('\n')),
            "part,camera,trajectory,method,frames,metric,mean,half_width_95,seeds");
  EXPECT_NE(csv.find("\n,cam,1,paper,12,trajectory.ate_mm,2,12.7062"), std::string::npos) << csv;
  EXPECT_NE(csv.find("\n,cam,1,paper,24,trajectory.ate_mm,5,,1\n"), std::string::npos) << csv;
  EXPECT_EQ(csv.find("seconds"), std::string::npos);
}

// What another run would measure otherwise is in times.json alone.
TEST(Tables, ResultsHoldNoTimes) {
  const Study study{"Title", "", std::vector<StudyOptions>(1)};
  const std::vector<CellResult> cells = {cell(0, 1, 1.0)};
  const std::vector<StudyPart> parts = {{study.parts[0], cells, {}, {}}};
  EXPECT_EQ(results_json(study, parts).dump().find("seconds"), std::string::npos);
  EXPECT_EQ(table_csv(cells),
            "part,camera,trajectory,method,frames,seed,simulation.frames,trajectory.ate_mm\n"
            ",cam,1,paper,12,1,12,1\n");
  EXPECT_EQ(times_json(parts).at("cells").at(0).at("time").at("seconds"), 3.0);
  EXPECT_EQ(times_json(parts).at("cells").at(0).at("simulation").at("seconds"), 4.0);
}

TEST(JUnit, AFailedGateOrCellIsAFailedTest) {
  std::vector<CellResult> cells = {cell(0, 1, 1.0), cell(0, 1, 1.0)};
  cells[1].cell.trajectory = "2";
  cells[1].metrics = {{"failed", "it <gave> up"}};
  const std::string xml =
      junit_xml("A & B", cells,
                {{"cam, trajectory 1", "a.b", "below 1", "0.5", "why", true},
                 {"cam, trajectory 2", "a.b", "below 1", "2", "it is < 1", false}});
  EXPECT_EQ(
      xml,
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<testsuite name=\"A &amp; B\" tests=\"4\" failures=\"2\">\n"
      "  <testcase classname=\"cam, trajectory 1, paper, frames=12, seed 1\" name=\"runs\"/>\n"
      "  <testcase classname=\"cam, trajectory 2, paper, frames=12, seed 1\" "
      "name=\"runs\"><failure message=\"it "
      "&lt;gave&gt; up\"/></testcase>\n"
      "  <testcase classname=\"cam, trajectory 1\" name=\"a.b below 1\"/>\n"
      "  <testcase classname=\"cam, trajectory 2\" name=\"a.b below 1\"><failure "
      "message=\"cam, trajectory 2: a.b is 2, expected below 1: it is &lt; 1\"/></testcase>\n"
      "</testsuite>\n");
}

}  // namespace
}  // namespace rugae
