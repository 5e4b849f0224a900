#pragma once
// What a mesh from elsewhere may lack before it can be the wall of a cavity.

#include <string>
#include <vector>

#include "core/mesh.h"

namespace rugae {

/// The triangles of one connected piece, unused vertices left out.
TriangleMesh piece_of(const TriangleMesh& mesh, const std::vector<int>& triangles);

/// Turns triangles so that neighbours wind alike, starting from the first; returns how many were
/// turned. Edges with other than two triangles are not crossed.
int wind_alike(TriangleMesh& mesh);

void turn_inside_out(TriangleMesh& mesh);

/// An open end that was closed: the way around it, mm, and its middle.
struct CappedEnd {
  double girth_mm = 0.0;
  Vec3 centre = Vec3::Zero();
};
/// Closes every open end by a fan of triangles around the middle of its border. Ends are walked
/// from edge to edge; borders that touch in a vertex are taken apart there.
std::vector<CappedEnd> cap_open_ends(TriangleMesh& mesh);

}  // namespace rugae
