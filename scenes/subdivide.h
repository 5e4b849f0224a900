#pragma once
// Refining and smoothing of closed meshes, and their normals.

#include "core/mesh.h"

namespace rugae {

/// Every triangle becomes four, and the surface tends to one with continuous curvature away from
/// irregular vertices: Loop, Smooth subdivision surfaces based on triangles, University of Utah
/// 1987. The mesh must be closed and manifold. Vertices and triangles only.
TriangleMesh subdivide_loop(const TriangleMesh& mesh);

/// Takes out bumps shorter than about `rounds` edges without shrinking the whole: Taubin, A signal
/// processing approach to fair surface design, SIGGRAPH 1995, doi:10.1145/218380.218473.
void smooth_taubin(TriangleMesh& mesh, int rounds);

/// Vertex normals: the mean of the adjacent triangles' normals with weight sin(angle) / (product of
/// the two sides), exact on a sphere; no function of the C library. Max, Weights for computing
/// vertex normals from facet normals, JGT 1999, doi:10.1080/10867651.1999.10487501.
std::vector<Vec3f> smooth_normals(const TriangleMesh& mesh);

}  // namespace rugae
