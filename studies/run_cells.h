#pragma once
// All cells of a study that are not finished: one after another, or several at a time in processes
// of their own within a budget of memory.

#include <filesystem>
#include <string>
#include <vector>

#include "core/progress.h"
#include "studies/cell_files.h"

namespace rugae {

struct RunOptions {
  int jobs = 1;                   // cells at a time
  double memory_gb = 0.0;         // for all of them together; 0: most of what is free now
  std::filesystem::path program;  // ours, for cells in processes of their own; empty: one at a time
  void check() const;
};

/// A cell that is to be made, and the command line that does so alone:
/// PROGRAM run STUDY --out OUT --cell INDEX.
struct CellJob {
  const StudyOptions* study = nullptr;
  Cell cell;
  CellFiles files;
  int index = 0;  // among all cells of the study
};

/// Makes those that are not finished. Cells that share a dataset or a motion wait for the first of
/// them, those of a study that says `alone` for all that is running, and what the study does not
/// keep goes as soon as no cell needs it. A process that is killed (no memory) marks its cell as
/// failed, the rest goes on, and the next run tries it again. Throws Error for input that will not
/// do, and Interrupted.
void run_cells(const std::vector<CellJob>& jobs, const std::filesystem::path& study_file,
               const std::filesystem::path& out, const RunOptions& options, Progress& progress);

/// Of its dataset; about as many where the paper's number is asked for.
int frames_of(const CellJob& job);
/// What a cell will need at most, measured on cameras of 250 x 250 to 1280 x 720 px: grows with
/// the pixels of a frame, and up to a bound with their number.
double memory_gb_of(const CellJob& job);

}  // namespace rugae
