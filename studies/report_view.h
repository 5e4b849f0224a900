#pragma once
// What the page's interactive view of a cell shows: the wall, the map with its errors, both paths,
// frames along the path with their labels. viewer/README.md lists the fields.

#include <map>
#include <string>

#include "studies/frame_pictures.h"
#include "studies/map_over_truth.h"
#include "studies/report_parts.h"

namespace rugae {

/// The views of a page. Many cells share its size: each then has fewer frames and triangles. A wall
/// that several cells share is written once.
class ReportViews {
 public:
  explicit ReportViews(std::size_t cells);

  /// A wall that cells have; nothing happens if it is known. All come before the first part().
  void add_wall(const TriangleMesh& wall);
  /// HTML with the geometry of all walls.
  std::string walls() const;

  /// HTML with the data as JSON, which the viewer turns into a view when its cell is opened. A cell
  /// that failed has its truth alone. Cells may be asked for side by side.
  std::string part(const CellView& view, const MapOverTruth& over,
                   const FramePictures& pictures) const;

 private:
  std::size_t triangles_;                      // of a mesh
  int stops_;                                  // frames with pictures
  std::map<std::string, TriangleMesh> walls_;  // simplified, by their ids
};

}  // namespace rugae
