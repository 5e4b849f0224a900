#include "render/scene_truth.h"

#include <nlohmann/json.hpp>

#include "core/check.h"
#include "core/files.h"
#include "scenes/instances.h"

namespace rugae {

std::string with_scene(const std::string& settings, const Scene& scene, int first_of,
                       double read_noise_factor) {
  auto json = nlohmann::ordered_json::parse(settings, nullptr, false);
  check(json.is_object(), "the settings are not a JSON object: {}", settings);
  if (!scene.resolved_yaml.empty()) json["scene_yaml"] = scene.resolved_yaml;
  if (first_of > 0) json["first_of_frames"] = first_of;
  if (read_noise_factor != 1.0) json["read_noise_factor"] = read_noise_factor;
  return json.dump();
}

void write_scene_truth(const Scene& scene, const std::filesystem::path& truth_folder) {
  if (!scene.resolved_yaml.empty())
    write_atomic(truth_folder / "scene.yaml",
                 "# Every default and every draw filled in; with seed " +
                     std::to_string(scene.seed) + " it gives the same scene.\n" +
                     scene.resolved_yaml);
  std::string regions = "region,name\n";
  for (int r = 0; r <= static_cast<int>(Region::duodenum); ++r)
    regions += fmt::format("{},{}\n", r, region_name(static_cast<Region>(r)));
  write_atomic(truth_folder / "regions.csv", regions);
  write_atomic(
      truth_folder / "instances.csv",
      instances_csv(scene.instances ? scene.instances->list() : std::vector<WallInstance>{}));
}

}  // namespace rugae
