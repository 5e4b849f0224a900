#include "studies/study.h"

#include <nlohmann/json.hpp>

#include "core/check.h"
#include "core/files.h"
#include "tests/studies/in_temporary_folder.h"
#include "tests/studies/page_without_viewer.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// A small camera on a short path: the whole loop in seconds.
class RunStudy : public InTemporaryFolder {
 protected:
  void SetUp() override {
    InTemporaryFolder::SetUp();
    write_atomic(folder_ / "small.yaml",
                 "name: small\nframes_in_paper: 0\ndiameter_mm: 5\n"
                 "lens: {model: brown_conrady, width: 160, height: 120, horizontal_fov_deg: 90}\n"
                 "sensor: {pixel_pitch_um: 3, fps: 30, bit_depth: 10, full_well_e: 10000, "
                 "read_noise_e: 5, shutter: global}\n");
    write_base(4);
    write_atomic(folder_ / "short.yaml", "like: base.yaml\n");
  }

  // What short.yaml builds on.
  void write_base(int length_cm) {
    write_atomic(folder_ / "base.yaml",
                 fmt::format("like: \"1\"\nlength_cm: {}\npasses: 1\n", length_cm));
  }

  fs::path write_study(const std::string& more) {
    const fs::path file = folder_ / "study.yaml";
    write_atomic(file, fmt::format("title: Tiny\nresolution: coarse\nframes: 12\n"
                                   "cameras: [{0}/small.yaml]\ntrajectories: [{0}/short.yaml]\n{1}",
                                   folder_.string(), more));
    return file;
  }

  StudyResult run(const fs::path& file) {
    Progress progress(Progress::Output::silent);
    return run_study(file, folder_ / "out", {}, progress);
  }

  int files_in(const std::string& part) {
    int count = 0;
    for ([[maybe_unused]] const auto& entry : fs::directory_iterator(folder_ / "out" / part))
      ++count;
    return count;
  }

  std::string unchanging() {  // every file below the datasets and estimates, with its time
    std::vector<std::string> lines;
    for (const char* part : {"datasets", "estimates", "metrics"})
      for (const auto& entry : fs::recursive_directory_iterator(folder_ / "out" / part))
        lines.push_back(fmt::format("{} {}", entry.path().string(),
                                    entry.last_write_time().time_since_epoch().count()));
    std::ranges::sort(lines);
    std::string text;
    for (const std::string& line : lines) text += line + "\n";
    return text;
  }
};

TEST_F(RunStudy, RunsTheLoopOnceAndKeepsWhatIsFinished) {
  const fs::path file = write_study("");
  const StudyResult first = run(file);
  EXPECT_EQ(first.cells, 1);
  EXPECT_TRUE(first.failed_gates.empty());
  const std::string page = read_text(first.report);
  EXPECT_NE(page.find("Inside the stomach"), std::string::npos);
  EXPECT_EQ(without_viewer(page).find("http"), std::string::npos);
  const json results = json::parse(read_text(folder_ / "out" / "results.json"));
  const json& cell = results.at("cells").at(0);
  EXPECT_EQ(cell.at("metrics").at("tracking").at("frames"), 12);
  EXPECT_EQ(cell.at("metrics").at("simulation").at("frames"), 12);
  EXPECT_TRUE(fs::exists(folder_ / "out" / "datasets" / cell.at("dataset") / "manifest.sha256"));
  EXPECT_EQ(read_text(folder_ / "out" / "table.csv").rfind("part,camera,trajectory,method", 0), 0u);

  const std::string before = unchanging();
  run(file);
  EXPECT_EQ(unchanging(), before);

  // Another gate changes no cell; one that fails is told with its reason. From here on without the
  // page's chapters of cells, which change none either.
  const StudyResult gated =
      run(write_study("details: false\ngates: [{metric: tracking.tracked_share, above: 1.5, "
                      "reason: more than all}]\n"));
  EXPECT_EQ(unchanging(), before);
  ASSERT_EQ(gated.failed_gates.size(), 1u);
  EXPECT_NE(gated.failed_gates[0].find("expected above 1.5: more than all"), std::string::npos);

  // Losing the metrics, as a killed run does, makes those anew and nothing else.
  fs::remove_all(folder_ / "out" / "metrics");
  run(file);
  EXPECT_EQ(
      json::parse(read_text(folder_ / "out" / "results.json")).at("cells").at(0).at("dataset"),
      cell.at("dataset"));

  // A change of the file that a file builds on is another dataset.
  write_base(5);
  run(file);
  EXPECT_NE(
      json::parse(read_text(folder_ / "out" / "results.json")).at("cells").at(0).at("dataset"),
      cell.at("dataset"));
}

TEST_F(RunStudy, AnUnknownKeyStopsItBeforeAnyWork) {
  const fs::path file = write_study("reconn: {}\n");
  try {
    run(file);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.what(), file.string() + ":6:1: unknown key 'reconn'; did you mean 'recon'?");
  }
  EXPECT_FALSE(fs::exists(folder_ / "out"));
}

// Two settings of the reconstruction share their frames; seeds do not.
TEST_F(RunStudy, CellsShareWhatIsTheSame) {
  const fs::path file = write_study(
      "details: false\nseeds: [1, 2]\naxes: {recon.keyframes.mean_flow_px: [20, 30]}\n"
      "gates: [{metric: tracking.frames, above: 11, reason: all there, where: "
      "{recon.keyframes.mean_flow_px: 20}}]\n");
  const StudyResult result = run(file);
  EXPECT_EQ(result.cells, 4);
  EXPECT_TRUE(result.failed_gates.empty());
  const json results = json::parse(read_text(folder_ / "out" / "results.json"));
  const json& cells = results.at("cells");
  EXPECT_EQ(cells.at(0).at("dataset"), cells.at(2).at("dataset"));
  EXPECT_NE(cells.at(0).at("dataset"), cells.at(1).at("dataset"));
  EXPECT_NE(cells.at(0).at("estimate"), cells.at(2).at("estimate"));
  EXPECT_EQ(cells.at(3).at("axes").at("recon.keyframes.mean_flow_px"), "30");
  EXPECT_EQ(cells.at(3).at("seed"), 2);
  EXPECT_EQ(results.at("gates").size(), 2u);
  EXPECT_NE(read_text(folder_ / "out" / "repeats.csv").find("tracking.tracked_share"),
            std::string::npos);
  // four cells, two gates
  EXPECT_NE(read_text(folder_ / "out" / "junit.xml").find("tests=\"6\" failures=\"0\""),
            std::string::npos);
  EXPECT_NE(
      read_text(folder_ / "out" / "report.html").find("recon.keyframes.mean_flow_px=30, seed 2"),
      std::string::npos);
  // A setting of the map leaves the motion as it is.
  EXPECT_EQ(files_in("motions"), 4);
  run(
      write_study("details: false\naxes: {recon.shading.iterations: [3, 5]}\n"
                  "recon: {keyframes: {mean_flow_px: 20}}\n"));
  EXPECT_EQ(files_in("motions"), 4);
  EXPECT_EQ(files_in("estimates"), 6);
}

// The numbers are those of a study that keeps everything, and so they stay when it runs again, for
// less, for more, or after it was killed while it cleared up.
TEST_F(RunStudy, KeepsNoMoreThanItIsAskedTo) {
  const std::string axes = "details: false\nseeds: [1, 2, 3]\n";
  run(write_study(axes));
  const auto cells = [&] {
    return json::parse(read_text(folder_ / "out" / "results.json")).at("cells");
  };
  const json expected = cells();
  const auto dataset = [&](std::size_t cell) {
    return folder_ / "out" / "datasets" / expected.at(cell).at("dataset");
  };
  const std::string manifest = read_text(dataset(1) / "manifest.sha256");

  const fs::path file = write_study(axes + "keep: results\n");
  const StudyResult result = run(file);
  EXPECT_EQ(cells(), expected);
  EXPECT_TRUE(fs::exists(dataset(0) / "manifest.sha256"));  // shown at the head of the page
  EXPECT_EQ(files_in("motions"), 1);
  EXPECT_EQ(files_in("estimates"), 1);
  for (const std::size_t cell : {1, 2}) {
    std::vector<std::string> left;
    for (const auto& entry : fs::recursive_directory_iterator(dataset(cell)))
      if (!entry.is_directory()) left.push_back(entry.path().filename());
    std::ranges::sort(left);
    EXPECT_EQ(left, (std::vector<std::string>{"000004.png", "dataset.json"}));
  }
  const std::string page = read_text(result.report);
  EXPECT_NE(page.find("a frame from inside the stomach"), std::string::npos);
  EXPECT_NE(page.find("paper_seed3, frame 4"), std::string::npos);  // its frame among all cells

  const std::string before = unchanging();
  run(file);
  EXPECT_EQ(unchanging(), before);

  // A first cell that failed has no frames to show, and the others' are gone.
  const std::string measured =
      (folder_ / "out" / "metrics" / (expected.at(0).at("estimate").get<std::string>() + ".json"))
          .string();
  const std::string metrics = read_text(measured);
  json failure = json::parse(metrics);
  failure["failed"] = "as if";
  write_atomic(measured, failure.dump());
  EXPECT_EQ(read_text(run(file).report).find("a frame from inside"), std::string::npos);
  EXPECT_FALSE(fs::exists(dataset(0) / "manifest.sha256"));
  write_atomic(measured, metrics);

  // What is asked of the same frames later renders them again, all of them, to the same bytes.
  run(write_study(axes + "recon: {shading: {iterations: 5}}\n"));
  EXPECT_EQ(read_text(dataset(1) / "manifest.sha256"), manifest);
}

}  // namespace
}  // namespace rugae
