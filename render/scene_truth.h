#pragma once
// What a dataset keeps of its scene: every value it was made with, and what lies on the wall.

#include <filesystem>
#include <string>

#include "scenes/scene.h"

namespace rugae {

/// `settings` (a JSON object) with the scene's resolved text in it under "scene_yaml": a scene file
/// that was edited between two runs makes another dataset. Throws Error when it is not JSON.
/// `read_noise_factor` stands beside it where a trajectory's file says one.
std::string with_scene(const std::string& settings, const Scene& scene, int first_of = 0,
                       double read_noise_factor = 1.0);

/// Writes scene.yaml, regions.csv and instances.csv into the dataset's truth folder.
void write_scene_truth(const Scene& scene, const std::filesystem::path& truth_folder);

}  // namespace rugae
