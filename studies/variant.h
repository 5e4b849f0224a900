#pragma once
// What a cell is made with, beside its camera, trajectory, method and seed.

#include <string>
#include <vector>

#include "core/yaml.h"
#include "recon/options.h"
#include "render/simulate.h"
#include "studies/axes.h"
#include "studies/oracle.h"

namespace rugae {

/// One combination of the study's axes.
struct Variant {
  std::vector<Setting> settings;  // empty where there are no axes
  SimulateOptions simulate;       // camera, trajectory and seed are those of the cell
  std::string scene_text;  // YAML of a scene that stands in the study; simulate.scene is then what
                           // it builds on
  std::vector<Change> camera_changes;  // of the cell's camera, by paths into its file
  ReconOptions recon;                  // method and seed are those of the cell
  Replace replace = Replace::nothing;
  bool calibrate = false;   // the lens is what boards tell of it, not the true one
  double lens_error = 0.0;  // and is wrong by this share on purpose: perturbed()
};

/// The same without what spoils frames: noise, highlights, vignetting and blur.
Variant with_clean_frames(Variant variant);

/// Reads the keys `scene` (a preset, a file, or a mapping as in a scene file), `resolution`,
/// `frames`, `render`, `recon`, `calibrate`, `lens_error` and `replace`. `study_file` is where
/// paths of the scene go from.
Variant read_variant(YamlReader& study, const std::string& study_file);

/// A camera's file with changes in it.
std::string camera_text(const std::string& camera, const std::vector<Change>& changes);

/// The variants of a study's text: one for each combination of its axes. An axis can set whatever
/// the file can; a change below `scene` builds on the scene that is named, one below `camera`
/// changes each of `cameras`. Throws Error with the place of the axis for a path or a value that
/// the file could not hold.
std::vector<Variant> read_variants(const std::string& text, const std::string& study_file,
                                   const std::vector<Axis>& axes,
                                   const std::vector<std::string>& cameras);

}  // namespace rugae
