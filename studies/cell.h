#pragma once
// A cell of a study: one camera on one trajectory, with one combination of the axes' values and one
// seed, reconstructed by one method.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/progress.h"
#include "studies/study_file.h"

namespace rugae {

struct Cell {
  std::string camera, trajectory, method;
  std::vector<Setting> settings = {};  // of the axes
  std::uint64_t seed = 1;
  bool one_of_seeds = false;  // the study has several
  int variant = 0;            // of the study
  // "misumi-v5506_1_paper": a name for files; behind it the number of the variant, "v2", and the
  // seed, "seed3", where there are several
  std::string name() const;
  std::string title() const;    // "misumi-v5506, trajectory 1, paper, frames=60, seed 3"
  std::string setting() const;  // what `title` says after the method
};

struct CellResult {
  Cell cell;
  std::filesystem::path dataset, estimate;
  nlohmann::json metrics;  // of evaluate(), and "simulation"
  bool kept = false;       // found finished from an earlier run
};

/// All combinations, camera by camera; seeds are the fastest but for methods.
std::vector<Cell> cells_of(const StudyOptions& study);

/// Simulates, reconstructs and evaluates. Every result lies in a folder named by the cell and a
/// hash of everything that made it (options, the text of every preset named, the version), so a
/// finished part is kept when the study runs again, and a part with other settings is made anew
/// beside it:
///   OUT/datasets/<camera>_<trajectory>_<hash>/    and .json beside it: the times of simulating
///   OUT/estimates/<camera>_<trajectory>_<method>_<hash>/
///   OUT/metrics/<camera>_<trajectory>_<method>_<hash>.json
CellResult run_cell(const StudyOptions& study, const Cell& cell, const std::filesystem::path& out,
                    Progress& progress);

}  // namespace rugae
