#pragma once
// The YAML file of a scene: reading it, drawing what it leaves to chance, writing what came out.

#include <filesystem>
#include <string>
#include <vector>

#include "scenes/chessboard.h"
#include "scenes/deformation.h"
#include "scenes/import.h"
#include "scenes/stomach.h"

namespace rugae {

enum class SceneKind { procedural, mesh, chessboard };

struct SceneFile {
  SceneKind kind = SceneKind::procedural;
  StomachOptions stomach;
  ImportOptions import;
  std::filesystem::path mesh;
  MucosaOptions mucosa;
  DeformationOptions deformation;
  ChessboardOptions board;  // of kind chessboard: all there is of it
};

/// With `like: NAME_OR_FILE` what the file does not say is as in that preset or file (core/like.h).
///
/// A number of `relief`, `mucosa`, `board`, `lesions` or `objects`, `scale` and `variation` may be
/// a distribution in place of a value:
///   {uniform: [least, most]}, {normal: [mean, deviation]} (cut off at two deviations),
///   {choice: [value, ...]} (all alike).
/// It is drawn by (seed, the key's path), so that no draw depends on what else the file holds.
/// Throws Error with file, line and column.
SceneFile read_scene_file(const std::filesystem::path& file, std::uint64_t seed);

/// The path of every key that a scene file may hold, such as "mucosa.wetness".
std::vector<std::string> list_scene_keys();

/// A file that holds every default and every draw, and builds on no other scene file: with the same
/// seed it gives the same scene. A mesh is named by its absolute path.
std::string resolved_yaml(const SceneFile& scene);

}  // namespace rugae
