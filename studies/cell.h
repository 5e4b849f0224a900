#pragma once
// A cell of a study: one camera on one trajectory, with one combination of the axes' values and one
// seed, reconstructed by one method.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "studies/study_file.h"

namespace rugae {

struct Cell {
  std::string camera, trajectory, method;
  std::vector<Setting> settings = {};  // of the axes
  std::uint64_t seed = 1;
  bool one_of_seeds = false;  // the study has several
  int variant = 0;            // of the study
  std::string part = {};      // of a study made of parts: the part's name
  // "misumi-v5506_1_paper": before it the part, behind it the number of the variant, "v2", and the
  // seed, "seed3", where there are several. No two cells of a study have the same.
  std::string name() const;
  std::string title() const;    // "misumi-v5506, trajectory 1, paper, frames=60, seed 3"
  std::string setting() const;  // what `title` says after the method
};

struct CellResult {
  Cell cell;
  std::filesystem::path dataset, estimate;
  nlohmann::json metrics;  // of evaluate(), and "simulation"; of a failure its reason, "failed"
};

/// All combinations, camera by camera; seeds are the fastest but for methods.
std::vector<Cell> cells_of(const StudyOptions& study);

/// "stomach" of "scenes/stomach.yaml" and of "stomach".
std::string stem(const std::string& name_or_path);

}  // namespace rugae
