#pragma once
// The numbers of a study as files: one JSON, one CSV.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "studies/cell.h"
#include "studies/gates.h"

namespace rugae {

/// {"title", "study": the file's text, "version", "cells": [{camera, trajectory, method, dataset,
/// estimate, metrics}], "gates": [...]}. The frame by frame arrays stay in the cells' own files.
nlohmann::json results_json(const StudyOptions& study, const std::string& study_text,
                            const std::vector<CellResult>& cells,
                            const std::vector<GateOutcome>& gates);

/// A row a cell, a column a metric (its path); empty where not measured. RFC 4180.
std::string table_csv(const std::vector<CellResult>& cells);

}  // namespace rugae
