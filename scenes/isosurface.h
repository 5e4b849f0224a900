#pragma once
// A closed, evenly triangulated surface from a signed distance.

#include <functional>

#include "core/mesh.h"

namespace rugae {

/// Distance-like field in mm, negative inside, with its gradient where one is asked for; |gradient|
/// at most `kSteepestField` anywhere.
using DistanceField = std::function<double(const Vec3& p, Vec3* gradient)>;
inline constexpr double kSteepestField = 1.1;

/// The zero level of the field inside `box`, by surface nets (Gibson, Constrained elastic surface
/// nets, MICCAI 1998) on a grid of `cell_mm` with a vertex a sheet (cell_sheets.h), then `rounds`
/// of tangential relaxation, each followed by a Newton step back onto the level. Closed and
/// manifold; vertices lie on the level; normals point to where the field is positive. Throws Error
/// naming `name` when there is no such level, or a box of too many cells. About 3 A / cell^2
/// triangles for an area A.
TriangleMesh isosurface(const DistanceField& field, const Eigen::AlignedBox3d& box, double cell_mm,
                        int rounds, const std::string& name);

/// Cuts every quad of such a mesh (its triangles come in pairs) along the diagonal with the better
/// angles: for after the vertices were moved.
void recut_quads(TriangleMesh& mesh);

}  // namespace rugae
