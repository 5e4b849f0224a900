#include "scenes/cell_sheets.h"

namespace rugae {
namespace {

// A face across `axis` at `side`, with its corners (i, j) along axis+1 and axis+2.
struct Face {
  int axis, side;
  int corner(int i, int j) const {
    return side << axis | i << (axis + 1) % 3 | j << (axis + 2) % 3;
  }
  // the edge along axis+1 at j, and the one along axis+2 at i
  int edge_u(int j) const { return 4 * ((axis + 1) % 3) + (j | side << 1); }
  int edge_w(int i) const { return 4 * ((axis + 2) % 3) + (side | i << 1); }
};

bool is_inside(CornerMask inside, int corner) { return inside >> corner & 1; }

bool is_ambiguous(CornerMask inside, const Face& face) {
  const bool a = is_inside(inside, face.corner(0, 0)), b = is_inside(inside, face.corner(1, 0));
  return is_inside(inside, face.corner(1, 1)) == a && is_inside(inside, face.corner(0, 1)) == b &&
         a != b;
}

}  // namespace

FaceMask ambiguous_faces(CornerMask inside) {
  FaceMask mask = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side)
      if (is_ambiguous(inside, {axis, side})) mask |= 1 << (2 * axis + side);
  return mask;
}

CellSheets cell_sheets(CornerMask inside, FaceMask inverted) {
  std::array<int, 12> group;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 4; ++side) {
      const int from = (side & 1) << (axis + 1) % 3 | (side >> 1) << (axis + 2) % 3;
      const int e = 4 * axis + side;
      group[e] = is_inside(inside, from) != is_inside(inside, from | 1 << axis) ? e : -1;
    }
  const auto join = [&group](int a, int b) {
    const int from = group[a], to = group[b];
    for (int& g : group)
      if (g == from) g = to;
  };
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      const Face face{axis, side};
      if (is_ambiguous(inside, face)) {
        const bool apart = !(inverted >> (2 * axis + side) & 1);
        for (int i = 0; i < 2; ++i)
          for (int j = 0; j < 2; ++j)
            if (is_inside(inside, face.corner(i, j)) == apart) join(face.edge_u(j), face.edge_w(i));
      } else {
        int first = -1;
        for (const int e : {face.edge_u(0), face.edge_u(1), face.edge_w(0), face.edge_w(1)}) {
          if (group[e] < 0) continue;
          if (first < 0)
            first = e;
          else
            join(first, e);
        }
      }
    }
  CellSheets sheets;
  std::array<int, 12> number;
  number.fill(-1);
  for (int e = 0; e < 12; ++e) {
    if (group[e] >= 0 && number[group[e]] < 0) number[group[e]] = sheets.count++;
    sheets.of_edge[e] = static_cast<std::int8_t>(group[e] < 0 ? -1 : number[group[e]]);
  }
  return sheets;
}

bool is_pinched(const CellSheets& sheets, int axis, int side) {
  const Face face{axis, side};
  const auto& of = sheets.of_edge;
  return of[face.edge_u(0)] == of[face.edge_u(1)] && of[face.edge_w(0)] == of[face.edge_w(1)] &&
         of[face.edge_u(0)] == of[face.edge_w(0)];
}

}  // namespace rugae
