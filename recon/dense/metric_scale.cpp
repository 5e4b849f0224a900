#include "recon/dense/metric_scale.h"

#include <fmt/format.h>

#include "recon/dense/light_scale.h"

namespace rugae {

void scale_by_light(const FrameSource& frames, const ReflectionOptions& reflections,
                    Structure& structure, Progress& progress) {
  const std::vector<Emitter>& lights = frames.observations().lights();
  if (all_central(lights)) return;
  progress.begin("scale from light");
  const std::vector<WallPatch> patches = make_patches(frames, structure);
  const auto scale =
      scale_from_light(light_sights(frames, structure, patches, reflections), lights);
  if (!scale) {
    progress.end("not seen: lengths stay in map units");
    return;
  }
  rescale(structure, scale->mm_per_unit);
  structure.scale_sigma_share = scale->sigma_share;
  progress.end(fmt::format(
      "{:.5g} mm a map unit, give or take {:.2g} %; {} sights, light within "
      "{:.2g} %",
      scale->mm_per_unit, 100.0 * scale->sigma_share, scale->sights, 100.0 * scale->spread_ln));
}

}  // namespace rugae
