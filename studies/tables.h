#pragma once
// The numbers of a study as files: one JSON, one CSV.

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "studies/study_part.h"

namespace rugae {

/// {"title", "study": the files' text, "cells": [{part, camera, trajectory, method, axes, seed,
/// dataset, estimate, metrics}], "gates": [...], "summaries": {...}}. The same bytes however often
/// the study was interrupted: frame by frame arrays stay in the cells' own files, times and memory
/// are in times_json().
nlohmann::json results_json(const Study& study, const std::vector<StudyPart>& parts);

/// {"cells": [{"cell", "time", "simulation"}]}: seconds and peak memory of what made each cell.
nlohmann::json times_json(const std::vector<StudyPart>& parts);

/// A row a cell; columns: the part where there are several, camera, trajectory, method, the axes by
/// their paths, seed, and each metric by its path, empty where not measured. RFC 4180.
std::string table_csv(const std::vector<CellResult>& cells);

/// The paths of all axes, in the order of the cells: parts have axes of their own.
std::vector<std::string> axis_paths(const std::vector<CellResult>& cells);
/// "camera,trajectory,method" and the axes: what a row of a file begins with, and its names.
std::string row_start(const Cell& cell, const std::vector<std::string>& axes);
std::string row_start_names(const std::vector<std::string>& axes);

/// The numbers of a cell that are the same each time it is made, by their paths.
std::map<std::string, double> numbers_of(const CellResult& cell);
/// A field of a CSV file, in quotes where it needs them.
std::string csv_field(const std::string& text);

}  // namespace rugae
