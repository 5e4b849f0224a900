#pragma once
// Plots as inline SVG; colours come from the page's style sheet, so that they follow light and
// dark.

#include <string>
#include <vector>

#include "core/mesh.h"

namespace rugae {

/// A direction to look from, in the axes of the stomach: x to the patient's left, y to the back,
/// z up.
struct Side {
  std::string name;
  Vec3 from;       // from the organ towards the eye
  Vec3 right, up;  // of the picture
};
/// From the front, and from the patient's left.
std::vector<Side> two_sides();

/// Paths for plots: one entry a frame; an estimate that is not finite was lost.
struct PathPlot {
  std::vector<Vec3> truth_mm, estimate_mm;
  std::vector<double> error_mm;  // of the estimate; decides its colour
  double worst_mm = 1.0;         // the error of the last colour
};

/// Both paths seen from a side, over the outline of the wall, with a line from each true position
/// to the estimated one.
std::string path_svg(const PathPlot& plot, const TriangleMesh& wall, const Side& side);

/// A curve over time with gaps where values are not finite; `marks_s` are ticks at the bottom (key
/// frames).
struct TimePlot {
  std::string title, unit;
  std::vector<double> time_s, value;
  std::vector<double> marks_s;
};
std::string time_svg(const TimePlot& plot);

/// Shares of a surface within a distance, for a few curves.
struct Curve {
  std::string name, css_class;
  std::vector<double> distances_mm;
};
std::string cumulative_svg(const std::vector<Curve>& curves, double longest_mm);

/// A step of 1, 2 or 5 times a power of ten that divides `span` into about `parts`.
double nice_step(double span, int parts);

}  // namespace rugae
