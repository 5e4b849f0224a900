#pragma once
// Meshes on disk: any format assimp reads, binary PLY and binary glTF written.

#include <filesystem>
#include <string>
#include <vector>

#include "core/mesh.h"

namespace rugae {

/// Reads all triangles of any file assimp reads, coordinates times `mm_per_unit`; vertices at the
/// same place are joined. Throws Error: missing file, "mesh.ply: no triangles ...", "mesh.ply:
/// vertex 12 is not finite", unreadable format.
TriangleMesh read_mesh(const std::filesystem::path& file, double mm_per_unit = 1.0);

/// Binary little-endian PLY: float or double x y z (double when `precise`), nx ny nz and red green
/// blue, float sigma when present. A comment says in what `unit` lengths are.
void write_ply(const std::filesystem::path& file, const TriangleMesh& mesh, bool precise = false,
               const std::string& unit = "mm");

/// glTF 2.0 binary (.glb) through tinygltf: positions in metres (the unit the format demands),
/// normals, linear COLOR_0 when colours and _SIGMA (metres) when sigma are present, one
/// double-sided material; axes as stored.
void write_glb(const std::filesystem::path& file, const TriangleMesh& mesh);

}  // namespace rugae
