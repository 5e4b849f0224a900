#pragma once
// Calibration from pictures of a chessboard: pictures -> corners -> lens.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cameras/camera.h"
#include "core/rigid3.h"

namespace rugae {

struct CalibrationOptions {
  int columns = 0, rows = 0;        // inner corners of the board; both 0: searched for
  double square_mm = 1.0;           // scales the board's poses alone, not the lens
  std::optional<LensModel> model;   // not given: chosen by its error and its number of terms
  double max_image_error_px = 3.0;  // a picture with a larger RMS error is rejected, and so is one
                                    // above three times the median
  int min_images = 3;
  void check() const;
};

/// The inner corners of a board in one picture, row by row, (0.5, 0.5) convention. The order has
/// the handedness of the image axes (x right, y down) whether or not the picture is mirrored.
struct BoardView {
  std::vector<Vec2> corners_px;
  int columns = 0, rows = 0;
};

struct CalibrationImage {
  std::filesystem::path file;
  bool used = false;
  std::string reason;                  // why it was not used
  BoardView board;                     // empty when no board was found
  double rms_px = 0.0, mean_px = 0.0;  // re-projection error, where a lens was fitted
  Rigid3 cam_from_board;               // mm; where used
};

/// What one lens model achieved.
struct ModelTrial {
  std::string name;  // "brown-conrady k1 k2", ...
  Lens lens;
  double mean_px = 0.0, rms_px = 0.0;
  std::string refused;  // why it cannot be the result, such as a turning point inside the image
};

struct CalibrationResult {
  Lens lens;
  int columns = 0, rows = 0;
  double mean_px = 0.0;  // mean re-projection error over all corners of the used pictures
  double rms_px = 0.0;
  int used = 0;
  std::vector<CalibrationImage> images;
  std::vector<ModelTrial> trials;
};

/// Pictures of a folder (PNG, JPEG, BMP; natural order of names), or the file itself. Throws Error
/// for a missing path or a folder without pictures.
std::vector<std::filesystem::path> pictures_in(const std::filesystem::path& folder_or_file);

/// Throws Error when pictures differ in size, when fewer than `min_images` show the board ("... the
/// board was found in 1 of 12 pictures ..."), or when no model fits.
CalibrationResult calibrate(const std::vector<std::filesystem::path>& pictures,
                            const CalibrationOptions& options);

/// The same from corners: `images` with boards found, all of width x height px.
CalibrationResult calibrate_boards(std::vector<CalibrationImage> images, int width, int height,
                                   const CalibrationOptions& options);

}  // namespace rugae
