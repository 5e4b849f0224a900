#pragma once
// A cell's map beside the wall that was seen: what the pictures and the interactive view both show.

#include <vector>

#include "core/mesh.h"
#include "studies/report_parts.h"
#include "validate/visibility.h"

namespace rugae {

struct MapOverTruth {
  Visibility visibility;   // of the wall; keeps a reference to it
  TriangleMesh seen_wall;  // empty where no depth is known
  // Empty where there is no map, or no path that would place it:
  TriangleMesh map;              // placed by the path, mm, winding as the wall does; with normals
  std::vector<double> error_mm;  // of the map's vertices: distance to `seen_wall`
  double worst_mm = 1.0;         // the error of the last colour: a round number above most errors

  bool has_map() const { return !map.empty(); }
};

/// Of a cell that failed too: it has no map. The cell's Truth must outlive the result.
MapOverTruth map_over_truth(const CellView& view);

}  // namespace rugae
