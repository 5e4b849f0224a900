#pragma once
// Where the parts of a cell lie: each in a file or folder named by a hash of everything that made
// it (options, the text of every preset named, the version), so that cells share what is the same,
// a finished part is kept when the study runs again, and a part with other settings is made beside
// it.

#include <filesystem>
#include <string>

#include "studies/calibration.h"
#include "studies/cell.h"

namespace rugae {

struct CellFiles {
  std::string camera;             // the cell's, or OUT/cameras/<camera>_<hash>.yaml: it changed
  std::filesystem::path dataset;  // OUT/datasets/<camera>_<trajectory>_<hash>/
  std::filesystem::path frames;   // the dataset whose frames are reconstructed: the same, but where
                                  // others take their place
  std::filesystem::path calibration;  // OUT/calibrations/<camera>_<hash>/, of a calibrated lens
  std::filesystem::path lens;         // OUT/lenses/<camera>_<hash>.yaml, of one wrong on purpose
  std::filesystem::path motion;       // OUT/motions/<camera>_<trajectory>_<hash>.cbor; ours alone
  std::filesystem::path estimate;     // OUT/estimates/<camera>_<trajectory>_<method>_<hash>/
  std::filesystem::path metrics;      // OUT/metrics/<camera>_<trajectory>_<method>_<hash>.json
  std::filesystem::path scene;        // OUT/scenes/<hash>.yaml, of a scene that stands in the study
  bool frames_kept = true;            // by the study, once the cell is measured

  /// The metrics are there, not those of a failure that is tried again, and the dataset where the
  /// study keeps it.
  bool finished() const;
};

/// What simulating measured: beside the dataset.
std::filesystem::path simulation_of(const std::filesystem::path& dataset);
bool dataset_finished(const std::filesystem::path& dataset);

/// A changed camera's file is written, since others are named by what it makes.
CellFiles files_of(const StudyOptions& study, const Cell& cell, const std::filesystem::path& out);

/// The boards that the cell's lens is calibrated from.
CalibrationRun calibration_of(const Variant& variant, const Cell& cell, const CellFiles& files);

/// Throws Error naming the file when it is not JSON.
nlohmann::json read_json(const std::filesystem::path& file);

/// The result of a cell that was made.
CellResult read_cell(const Cell& cell, const CellFiles& files);

}  // namespace rugae
