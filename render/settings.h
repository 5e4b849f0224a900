#pragma once
// How frames are made from a scene, a camera and a path: every effect is one switch. In YAML the
// sections are mappings (`sensor: {noise: false}`).

#include <string>
#include <vector>

#include "core/field.h"
#include "core/yaml.h"
#include "dataset/label_images.h"
#include "render/sensor_settings.h"

namespace rugae {

struct LensSettings {
  bool vignetting = true;
  bool rolling_shutter = true;  // where the camera has one
  int samples = 1;              // rays a pixel; 1: through its centre
  bool motion_blur = false;     // over the exposure time
  bool defocus = false;         // thin lens with the camera's f-number and focus
};

struct TruthSettings {
  LabelSet labels;        // in YAML their names stand beside the others
  int tracks = 0;         // points of the wall followed over the sequence
  bool coverage = false;  // in how many frames each triangle is seen; needs triangles
};

struct LightSettings {
  bool highlights = true;  // the lights mirrored by the wet layer
  int bounces = 0;         // of light between walls, before it comes to the camera
  int samples = 16;        // paths a pixel, where there are bounces
  bool roulette = true;    // long paths end by chance, without bias
};

struct RenderSettings {
  LensSettings lens;
  LightSettings light;
  SensorSettings sensor;
  OutputSettings output;
  bool labels = true;  // truth images; false: none of them, whatever `truth` says
  TruthSettings truth;
  /// The label images that there will be.
  LabelSet wanted_labels() const { return labels ? truth.labels : LabelSet::none(); }
  /// Throws Error naming the field, its value and its range.
  void check() const;
};

/// Keeps what the mapping does not name. Throws Error with file, line and column.
void read_settings(YamlReader yaml, RenderSettings& settings);

/// One change by its path, such as "sensor.noise=false". Throws Error naming the change.
void change_setting(const std::string& change, RenderSettings& settings);

/// Every setting's path and range.
std::vector<Field> list_settings();

/// Every setting, as JSON.
std::string settings_json(const RenderSettings& settings);

}  // namespace rugae
