#pragma once
// What a study keeps of its cells once they are measured. Frames with their labels are by far the
// largest part of it: a study over a hundred stomachs would fill a disk with what nobody looks at.

#include <filesystem>
#include <vector>

#include "studies/run_cells.h"

namespace rugae {

/// The frame of a dataset that stands for it among all cells of a page, and that is kept.
int frame_of_sheet(const std::filesystem::path& dataset);

/// Removes datasets, motions and estimates whose cells are all finished, and all of studies with
/// `keep: results`. Of a dataset stay dataset.json and the frame of the page's sheet, and the first
/// cell that did not fail is kept whole: the head of the page shows it. Killed at any moment it
/// leaves datasets that a later run completes.
void discard_finished(const std::vector<CellJob>& jobs);

}  // namespace rugae
