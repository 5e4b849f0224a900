#pragma once
// What a study file asks for.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "recon/options.h"
#include "render/simulate.h"

namespace rugae {

/// A bound on a metric, for every cell it names (all, where it names nothing).
struct Gate {
  std::string metric;  // a path into a cell's metrics, such as "trajectory.ate_sim3_rmse_mm"
  std::optional<double> above, below;
  std::string reason;
  std::string camera, trajectory, method;  // empty: any
};

/// Keys of the file have the same names; `frames`, `seed`, `noise`, `vignetting`, `scene` and
/// `resolution` go to `simulate`.
struct StudyOptions {
  std::string title = "A stomach, simulated and reconstructed";
  SimulateOptions simulate;  // camera and trajectory are those of the cell
  std::vector<std::string> cameras, trajectories, methods{"paper"};
  ReconOptions recon;
  std::vector<Gate> gates;
};

/// Reads a study file; throws Error with file, line and column for an unknown key, a wrong type,
/// a value out of range, a preset that does not exist, or a gate without a bound or a reason.
StudyOptions read_study(const std::filesystem::path& file);
/// The same from text; `name` stands for the file in errors.
StudyOptions read_study_text(const std::string& text, const std::string& name);

}  // namespace rugae
