#pragma once
// Making a cell: simulate, reconstruct, evaluate.

#include "core/progress.h"
#include "studies/cell_files.h"

namespace rugae {

/// Makes what is missing of `files` and ends with the metrics; parts that are there are kept. A
/// method that gives up on the frames is a result like any other: metrics with the reason in
/// "failed". Throws Error for input that will not do, and Interrupted.
void make_cell(const StudyOptions& study, const Cell& cell, const CellFiles& files,
               Progress& progress);

/// Metrics of a cell that came to nothing; with `try_again` the next run makes it anew.
void write_failure(const CellFiles& files, const std::string& reason, bool try_again);

}  // namespace rugae
