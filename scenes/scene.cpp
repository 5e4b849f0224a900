#include "scenes/scene.h"

#include "core/check.h"
#include "core/presets.h"
#include "core/yaml.h"
#include "scenes/stomach.h"

namespace rugae {
Scene load_scene(const SceneRequest& request) {
  // for the ~72,000 mm^2 of the whole wall: 3 A / cell^2 triangles
  StomachOptions options;
  const double cell = request.resolution == "coarse" ? 2.15
                      : request.resolution == "fine" ? 0.48
                                                     : 0.96;
  auto wall = make_stomach(options, request.seed, cell);
  MucosaOptions mo;
  mo.oil = request.oil;
  Scene scene{.name = request.name_or_path,
              .wall = std::move(wall.mesh),
              .rest_positions = {},
              .regions = std::move(wall.regions),
              .mucosa = Mucosa(mo, request.seed),
              .seed = request.seed};
  scene.rest_positions = scene.wall.vertices;
  return scene;
}
}  // namespace rugae
