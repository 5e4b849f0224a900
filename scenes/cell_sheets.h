#pragma once
// Which of a grid cell's cut edges belong to one sheet of the surface. A cell may hold several
// sheets; each gets its own vertex, so that the surface is a manifold: Nielson, Dual marching
// cubes, IEEE Visualization 2004, doi:10.1109/VISUAL.2004.28.
//
// Corner c of a cell has its offsets along x, y, z in bits 0, 1, 2. Edge 4 axis + side runs along
// `axis`, displaced along axis+1 by bit 0 of `side` and along axis+2 by bit 1 (cyclic).

#include <array>
#include <cstdint>

namespace rugae {

/// Bit c is set where corner c lies inside.
using CornerMask = std::uint8_t;
/// Bit 2 axis + side: the cell's face across `axis`, low (0) or high (1).
using FaceMask = std::uint8_t;

struct CellSheets {
  std::array<std::int8_t, 12> of_edge;  // -1 where the edge is not cut
  int count = 0;
};

/// Faces whose diagonals have unlike signs: they are cut twice, in one of two ways.
FaceMask ambiguous_faces(CornerMask inside);

/// Sheets by joining the cuts of each face. On an ambiguous face the inside corners are kept apart,
/// or, where `inverted` has its bit, the outside ones.
CellSheets cell_sheets(CornerMask inside, FaceMask inverted);

/// All four cuts of an ambiguous face lie on one sheet. If so in both cells of a face, four quads
/// would share an edge there: the face must be inverted.
bool is_pinched(const CellSheets& sheets, int axis, int side);

}  // namespace rugae
