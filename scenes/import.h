#pragma once
// The wall of a scene from any mesh file.

#include <filesystem>
#include <string>
#include <vector>

#include "core/mesh.h"
#include "scenes/relief.h"

namespace rugae {

/// Where the file's triangle normals point.
enum class WallNormals { automatic, outward, inward };
enum class OpenEnds { cap, refuse };

struct ImportOptions {
  double mm_per_unit = 1.0;
  WallNormals wall = WallNormals::automatic;  // automatic: by the sign of the enclosed volume
  OpenEnds open_ends = OpenEnds::cap;
  int component = 0;            // which connected piece is the wall, by number of triangles
  double target_edge_mm = 0.0;  // of the medium resolution; 0: for its usual number of triangles
  bool with_relief = true;
  ReliefOptions relief;
  void check(const std::string& where) const;
};

struct ImportedWall {
  TriangleMesh mesh;               // closed, outward
  std::vector<std::string> notes;  // what was found and done, one line each
};

/// Reads, checks and closes the mesh, resamples it to even triangles (2^level halvings of four
/// times the medium's edge: level 1 coarse, 2 medium, 3 fine, all of the same smooth surface), and
/// gives it relief. Throws Error in one line for a missing file, no triangles, a coordinate that is
/// not finite, a size no organ has (with the mm_per_unit it suggests), open ends where refused.
ImportedWall import_wall(const std::filesystem::path& file, const ImportOptions& options,
                         std::uint64_t seed, int level);

}  // namespace rugae
