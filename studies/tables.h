#pragma once
// The numbers of a study as files: one JSON, one CSV.

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "studies/cell.h"
#include "studies/gates.h"

namespace rugae {

/// {"title", "study": the file's text, "cells": [{camera, trajectory, method, axes, seed, dataset,
/// estimate, metrics}], "gates": [...]}. The same bytes however often the study was interrupted:
/// frame by frame arrays stay in the cells' own files, times and memory are in times_json().
nlohmann::json results_json(const StudyOptions& study, const std::string& study_text,
                            const std::vector<CellResult>& cells,
                            const std::vector<GateOutcome>& gates);

/// {"cells": [{"cell", "time", "simulation"}]}: seconds and peak memory of what made each cell.
nlohmann::json times_json(const std::vector<CellResult>& cells);

/// A row a cell; columns: camera, trajectory, method, the axes by their paths, seed, and each
/// metric by its path, empty where not measured. RFC 4180.
std::string table_csv(const std::vector<CellResult>& cells);

/// The numbers of a cell that are the same each time it is made, by their paths.
std::map<std::string, double> numbers_of(const CellResult& cell);
/// A field of a CSV file, in quotes where it needs them.
std::string csv_field(const std::string& text);

}  // namespace rugae
