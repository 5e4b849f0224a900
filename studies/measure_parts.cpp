#include "studies/measure_parts.h"

#include "dataset/layout.h"
#include "dataset/writer.h"

namespace rugae {

PreprocessOptions as_observed() {
  PreprocessOptions options;
  options.undistort = options.devignette = false;
  options.reflections.suppress_for_pose = options.reflections.suppress_for_map = false;
  return options;
}

DatasetSettings dataset_settings(const std::filesystem::path& dataset) {
  const std::filesystem::path file = DatasetLayout{dataset}.info();
  const DatasetInfo info = read_info(file);
  DatasetSettings settings;
  settings.labels = info.truth.labels;
  // The scene's own options stand beside those of rendering.
  const nlohmann::json options = nlohmann::json::parse(info.text);
  nlohmann::json render = nlohmann::json::object();
  for (const char* section : {"lens", "light", "sensor", "output"})
    if (options.contains(section)) render[section] = options.at(section);
  read_settings(YamlReader::from_text(render.dump(), file.string()), settings.render);
  return settings;
}

}  // namespace rugae
