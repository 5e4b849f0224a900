#pragma once
// Calibration in the loop: the board seen through the very camera of a study, and the lens that
// comes of it.

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "core/progress.h"
#include "render/settings.h"

namespace rugae {

struct CalibrationRun {
  std::string camera;                     // preset or file
  std::string scene = "chessboard";       // preset or file, of kind chessboard
  std::string trajectory = "chessboard";  // preset or file, around a board
  int views = 0;                          // 0: as many as the trajectory has
  std::uint64_t seed = 1;                 // draws the views and the noise
  RenderSettings render;                  // of the study's frames: lens, light, sensor, output
  int threads = 0;                        // 0: all
};

struct CalibratedLens {
  std::filesystem::path file;  // for Observations::open
  nlohmann::json metrics;      // {"calibration": {...}}, below
  bool kept = false;           // found finished from an earlier run
};

/// OUT/calibrations/<camera>_<hash>, the hash being that of everything the result is a function of:
/// runs that differ in nothing that matters to it have the same folder. Throws Error for a camera,
/// scene or trajectory that will not do.
std::filesystem::path calibration_folder(const CalibrationRun& run,
                                         const std::filesystem::path& out);

/// Renders the board with the run's settings (labels apart, and automatic exposure has settled on
/// each view, since the board is held still), finds its corners in the frames, fits a lens, and
/// writes to calibration_folder(run, out)
///   lens.yaml         what was calibrated; the field stop, which no board shows, is the camera's
///   calibration.json  every view and model, and the errors against the true lens; written last
///   views.jpg         the frames with the corners that were found
///   coverage.png      all corners over the picture
///   board/            the dataset of the views
/// A finished folder is kept. Two runs of the same folder must not go on at the same time.
///
/// Metrics: calibration.views, used_views, rms_px (re-projection), focal_error_share (mean of fx
/// and fy), principal_point_error_px, projection_rms_px and projection_corner_px
/// (cameras/lens_difference.h). Throws Error when the board is found in too few views.
CalibratedLens calibrated_lens(const CalibrationRun& run, const std::filesystem::path& out,
                               Progress& progress);

}  // namespace rugae
