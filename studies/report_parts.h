#pragma once
// The parts of a cell's chapter in the report; each returns HTML.

#include <string>
#include <vector>

#include "core/sim3.h"
#include "dataset/estimate.h"
#include "dataset/truth.h"
#include "studies/cell.h"
#include "studies/plots.h"
#include "studies/summary.h"

namespace rugae {

/// What the parts look at.
struct CellView {
  const CellResult& cell;
  const Truth& truth;
  const Estimate& estimate;
  bool many_cells = false;  // fewer and smaller pictures, so that the page stays small
};

class FramePictures;  // studies/frame_pictures.h
struct MapOverTruth;  // studies/map_over_truth.h

/// Both paths, frame by frame; where the method gave up, every estimate is lost.
PathPlot path_plot(const CellView& view);

/// The numbers a reader looks for first, the paper's beside them.
std::string headline_cards(const CellView& view);
/// Frames with their labels, in a grid.
std::string frames_part(const CellView& view, const FramePictures& pictures);
/// The frames of frames_part.
std::vector<int> shown_frames(const CellView& view);
/// The pictures the reconstruction left of its stages.
std::string stages_part(const CellView& view);
/// The estimated path over the true one, and its error over time.
std::string path_part(const CellView& view);
/// The map beside the wall, coloured by its error.
std::string map_part(const CellView& view, const MapOverTruth& over);
/// Every metric.
std::string tables_part(const CellView& view);

/// Tables with the published numbers beside ours, findings, curves and bars; empty without any.
std::string summary_part(const Summary& summary);

/// A frame of the dataset for the head of the page, as data URI.
std::string cover_picture(const CellView& view);

}  // namespace rugae
