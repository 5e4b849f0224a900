#pragma once
// The ray tracing library's tree over a wall's triangles: built for a wall at rest, refitted for
// one that has moved.

#include <embree3/rtcore.h>

#include <array>
#include <vector>

#include "core/types.h"

namespace rugae {

/// One list of vertices, or three for walls that move while rays are sent.
struct Hierarchy {
  RTCScene scene = nullptr;
  RTCGeometry geometry = nullptr;
  std::array<float*, 3> vertices{};
  unsigned steps = 1;
};
/// As many as the hierarchy's steps; of three the middle one is that of now.
using VertexLists = std::array<const std::vector<Vec3>*, 3>;

/// A hierarchy without vertices yet. Throws Error where memory does not suffice.
Hierarchy make_hierarchy(RTCDevice device, const std::vector<Vec3i>& triangles,
                         std::size_t vertex_count, unsigned steps, bool refitted);

/// Gives it its vertices, less `center`, and builds or refits it. The traversal computes in single
/// precision, each instruction set in its own way: near an outline some propose the fold and some
/// the wall behind it. So it is given walls that are thicker by somewhat more than its rounding (on
/// the side of the lumen, against the winding's normals): it proposes every fold that the exact ray
/// meets, and some that the exact ray passes, which are refused.
void place_vertices(const Hierarchy& hierarchy, RTCDevice device, const VertexLists& lists,
                    const std::vector<Vec3i>& triangles, const Vec3& center, double swell_mm);

}  // namespace rugae
