#pragma once
// A dataset in the layouts that other programs read. One file a format; what each holds and where
// its conventions differ from ours: docs/export.md.

#include <filesystem>
#include <string>
#include <vector>

#include "core/progress.h"

namespace rugae {

struct ExportOptions {
  std::string format;         // one of export_formats()
  double depth_per_mm = 0.0;  // steps of depth images; 0: as the format has it
  /// Throws Error naming the field and its value.
  void check() const;
};

struct ExportReport {
  int frames = 0;
  std::vector<std::string> notes;  // what the format cannot say, or what must be told its reader
};

/// Names and what they are.
struct ExportFormat {
  std::string name, what;
};
std::vector<ExportFormat> export_formats();

/// Writes a finished dataset into `out`, which must be empty or hold an earlier export of the same
/// dataset with the same options: that one goes on where it stopped, the lists that name the frames
/// being written last. Throws Error for a folder that holds something else or lies in the dataset,
/// and for an unfinished dataset.
ExportReport export_dataset(const std::filesystem::path& dataset, const ExportOptions& options,
                            const std::filesystem::path& out, Progress& progress);

}  // namespace rugae
