#pragma once
// Reads back the binary PLY files that core/mesh_io writes, as exactly as they were written: assimp
// keeps vertices as float and renumbers them, and reads no file without faces.

#include <filesystem>

#include "core/mesh.h"

namespace rugae {

/// Vertices, triangles, and normals, colours and sigma where present, of a binary little-endian PLY
/// in the layout of write_ply; faces may be none (a point cloud). Throws Error naming the file when
/// it is not such a PLY, is truncated, or holds a vertex that is not finite, a sigma not above 0 or
/// an index out of range.
TriangleMesh read_ply(const std::filesystem::path& file);

}  // namespace rugae
