// The board seen through a camera, and the lens that comes of it.

#include "studies/calibration.h"

#include <algorithm>
#include <cmath>

#include "cameras/camera.h"
#include "core/check.h"
#include "core/files.h"
#include "core/pose_track.h"
#include "dataset/check_dataset.h"
#include "dataset/image_io.h"
#include "dataset/layout.h"
#include "dataset/observations.h"
#include "recon/chessboard.h"
#include "render/simulate.h"
#include "tests/message_of.h"
#include "tests/studies/in_temporary_folder.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;
constexpr int kColumns = 6, kRows = 5;
constexpr double kSquare_mm = 3.0;

class Calibration : public InTemporaryFolder {
 protected:
  void SetUp() override {
    InTemporaryFolder::SetUp();
    write_camera("small", "model: brown_conrady, k1: -0.2, k2: 0.03, p1: 0.0008, p2: -0.0006");
    write_atomic(folder_ / "board.yaml",
                 fmt::format("like: chessboard\nboard: {{columns: {}, rows: {}, square_mm: {}}}\n",
                             kColumns, kRows, kSquare_mm));
    run_.camera = (folder_ / "small.yaml").string();
    run_.scene = (folder_ / "board.yaml").string();
    run_.views = 20;
    run_.render.lens.samples = 4;
  }

  void write_camera(const std::string& name, const std::string& lens,
                    const char* shutter = "global") {
    write_atomic(
        folder_ / (name + ".yaml"),
        fmt::format("name: {}\nframes_in_paper: 0\ndiameter_mm: 5\n"
                    "lens: {{{}, width: 320, height: 240, horizontal_fov_deg: 95, cx: 161.3, "
                    "cy: 118.9}}\n"
                    "sensor: {{pixel_pitch_um: 6, fps: 30, bit_depth: 10, full_well_e: "
                    "18000, read_noise_e: 10, shutter: {}}}\n",
                    name, lens, shutter));
  }

  CalibratedLens calibrated(const CalibrationRun& run) {
    Progress progress(Progress::Output::silent);
    return calibrated_lens(run, folder_ / "out", progress);
  }
  void simulate_board(const SimulateOptions& options, const std::string& folder) {
    Progress progress(Progress::Output::silent);
    simulate(options, folder_ / folder, progress);
  }
  SimulateOptions board_options() const {
    SimulateOptions options;
    options.scene = run_.scene;
    options.camera = run_.camera;
    options.trajectory = "chessboard";
    options.frames = 6;
    options.render = run_.render;
    return options;
  }

  CalibrationRun run_;
};

// From where the true camera sees each corner of the board to the nearest one that was found.
std::vector<double> corner_errors_px(const fs::path& dataset, const Lens& lens) {
  const DatasetLayout layout{dataset};
  const PoseTrack track = read_tum(layout.trajectory());
  std::vector<double> errors;
  for (std::size_t i = 0; i < track.size(); ++i) {
    const auto board =
        find_board(read_image_gray(layout.frame(static_cast<int>(i))), kColumns, kRows);
    EXPECT_TRUE(board) << "view " << i;
    if (!board) continue;
    const Rigid3 cam_from_world = track[i].world_from_camera.inverse();
    for (int k = 0; k < kColumns * kRows; ++k) {
      const Vec2 seen = lens.project(cam_from_world *
                                     Vec3(k % kColumns * kSquare_mm, k / kColumns * kSquare_mm, 0))
                            .value();
      double nearest = 1e9;
      for (const Vec2& corner : board->corners_px)
        nearest = std::min(nearest, (corner - seen).norm());
      errors.push_back(nearest);
    }
  }
  return errors;
}

TEST_F(Calibration, CornersAreFoundWhereTheTrueCameraSeesThem) {
  SimulateOptions options = board_options();
  options.render.sensor.noise = false;
  options.render.labels = false;
  simulate_board(options, "clean");
  auto errors = corner_errors_px(folder_ / "clean", load_camera(run_.camera).lens);
  ASSERT_EQ(errors.size(), 6u * kColumns * kRows);
  double sum = 0.0;
  for (const double e : errors) sum += e * e;
  const double rms = std::sqrt(sum / static_cast<double>(errors.size()));
  RecordProperty("rms_px", std::to_string(rms));
  EXPECT_LE(rms, 0.03);  // edges of 4 rays a pixel
  EXPECT_LE(*std::ranges::max_element(errors), 0.12);
}

TEST_F(Calibration, ABoardIsAnOrdinaryDataset) {
  SimulateOptions options = board_options();
  options.render.lens.samples = 1;
  options.render.truth.labels.albedo = true;
  simulate_board(options, "board");
  const DatasetCheck check = check_dataset(folder_ / "board");
  EXPECT_TRUE(check.problems.empty()) << check.problems.front();
  EXPECT_EQ(check.frames, 6);
  // ... the same for any number of threads, and under a rolling shutter: the board is held still.
  options.threads = 1;
  simulate_board(options, "again");
  write_camera("rolling", "model: brown_conrady, k1: -0.2, k2: 0.03, p1: 0.0008, p2: -0.0006",
               "rolling");
  options.camera = (folder_ / "rolling.yaml").string();
  simulate_board(options, "rolling");
  for (int i = 0; i < 6; ++i)
    for (const char* folder : {"again", "rolling"})
      EXPECT_EQ(read_text(DatasetLayout{folder_ / folder}.frame(i)),
                read_text(DatasetLayout{folder_ / "board"}.frame(i)))
          << folder << ' ' << i;
  EXPECT_FALSE(fs::exists(DatasetLayout{folder_ / "rolling"}.row_poses(0)));
  EXPECT_TRUE(check_dataset(folder_ / "rolling").problems.empty());
}

TEST_F(Calibration, SceneAndTrajectoryBelongTogether) {
  SimulateOptions options = board_options();
  options.trajectory = "1";
  EXPECT_EQ(message_of([&] { simulate_board(options, "a"); }),
            "scene '" + run_.scene +
                "' is a flat chessboard, in which no path can be planned; try the trajectory "
                "'chessboard'");
  options = board_options();
  options.scene = "stomach";
  options.resolution = "coarse";
  EXPECT_EQ(message_of([&] { simulate_board(options, "b"); }),
            "trajectory 'chessboard' looks at a chessboard, but scene 'stomach' is none; try the "
            "scene 'chessboard'");
  options = board_options();
  options.camera = "stereo";
  EXPECT_EQ(message_of([&] { simulate_board(options, "c"); }),
            "trajectory 'chessboard' is planned for one camera; simulate the cameras of rig "
            "'stereo' one by one");
}

TEST_F(Calibration, TheLensComesBack) {
  for (const bool noise : {false, true}) {
    run_.render.sensor.noise = noise;
    const CalibratedLens made = calibrated(run_);
    const auto& m = made.metrics.at("calibration");
    SCOPED_TRACE(m.dump());
    EXPECT_FALSE(made.kept);
    EXPECT_EQ(m.at("used_views"), 20);
    EXPECT_LE(m.at("rms_px").get<double>(), 0.06);
    EXPECT_LE(std::abs(m.at("focal_error_share").get<double>()), 1e-3);
    EXPECT_LE(m.at("principal_point_error_px").get<double>(), 0.15);
    EXPECT_LE(m.at("projection_rms_px").get<double>(), 0.1);
    EXPECT_LE(m.at("projection_corner_px").get<double>(), 0.4);
    const Lens lens = load_lens(made.file), truth = load_camera(run_.camera).lens;
    EXPECT_EQ(lens.model, LensModel::brown_conrady);
    EXPECT_NE(lens.fx, truth.fx);  // what was calibrated, not what is true
    EXPECT_NEAR(lens.fx, truth.fx, 1e-3 * truth.fx);
    for (const char* file : {"views.jpg", "coverage.png", "calibration.json"})
      EXPECT_TRUE(fs::exists(made.file.parent_path() / file)) << file;
  }
}

TEST_F(Calibration, AFisheyeKeepsItsFieldStop) {
  write_camera("fish",
               "model: kannala_brandt, k1: -0.02, field_stop: circle, field_stop_radius: 1.1");
  run_.camera = (folder_ / "fish.yaml").string();
  const CalibratedLens made = calibrated(run_);
  const Lens lens = load_lens(made.file);
  EXPECT_EQ(lens.model, LensModel::kannala_brandt);
  EXPECT_EQ(lens.stop.shape, StopShape::circle);
  EXPECT_EQ(lens.stop.radius, 1.1);
  EXPECT_LE(made.metrics.at("calibration").at("projection_rms_px").get<double>(), 0.1);
}

TEST_F(Calibration, AFinishedOneIsKeptAndAnotherIsMadeBesideIt) {
  run_.views = 5;
  const CalibratedLens first = calibrated(run_);
  const auto written = fs::last_write_time(first.file);
  const CalibratedLens again = calibrated(run_);
  EXPECT_TRUE(again.kept);
  EXPECT_EQ(again.file, first.file);
  EXPECT_EQ(again.metrics, first.metrics);
  EXPECT_EQ(fs::last_write_time(again.file), written);
  // killed before the last file: made again, to the same lens
  const std::string lens = read_text(first.file);
  fs::remove(first.file.parent_path() / "calibration.json");
  fs::remove(first.file);
  EXPECT_FALSE(calibrated(run_).kept);
  EXPECT_EQ(read_text(first.file), lens);
  // labels change nothing that is seen; the lens' settings do, and the seed
  CalibrationRun other = run_;
  other.render.labels = false;
  EXPECT_TRUE(calibrated(other).kept);
  other.render.lens.vignetting = false;
  EXPECT_NE(calibrated(other).file, first.file);
  other = run_;
  other.seed = 2;
  EXPECT_NE(calibrated(other).file, first.file);
}

TEST_F(Calibration, OnlyABoardCalibrates) {
  run_.scene = "stomach";
  EXPECT_EQ(message_of([&] { calibrated(run_); }),
            "scene 'stomach' is no chessboard, from which a lens can be calibrated");
}

}  // namespace
}  // namespace rugae
