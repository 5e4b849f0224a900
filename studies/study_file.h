#pragma once
// What a study file asks for.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "recon/options.h"
#include "render/simulate.h"
#include "studies/axes.h"
#include "studies/external.h"

namespace rugae {

/// What a cell runs with: one combination of the study's axes.
struct Variant {
  std::vector<Setting> settings;  // empty where there are no axes
  SimulateOptions simulate;       // camera, trajectory and seed are those of the cell
  ReconOptions recon;             // method and seed likewise
};

/// A bound on a metric, for every cell it names (all, where it names nothing).
struct Gate {
  std::string metric;  // a path into a cell's metrics, such as "trajectory.ate_sim3_rmse_mm"
  std::optional<double> above, below;
  std::string reason;
  std::string camera, trajectory, method;  // empty: any
  std::vector<Setting> settings;           // those it names must be the cell's
};

/// Keys of the file have the same names; `frames`, `scene`, `resolution` and `render` go to
/// `simulate`.
struct StudyOptions {
  std::string title = "A stomach, simulated and reconstructed";
  std::vector<std::string> cameras, trajectories, methods{"paper"};
  std::vector<ExternalMethod> commands;  // methods that are programs of their own
  std::vector<std::uint64_t> seeds{1};   // each draws the stomach, the paths and the noise anew
  std::vector<Variant> variants{1};      // at least one
  std::vector<Gate> gates;

  /// Null for a method of ours.
  const ExternalMethod* command_of(const std::string& method) const;
};

/// Reads a study file; throws Error with file, line and column for an unknown key, a wrong type,
/// a value out of range, a preset that does not exist, a gate without a bound or a reason, or an
/// axis whose path or value the file itself could not hold.
StudyOptions read_study(const std::filesystem::path& file);
/// The same from text; `name` stands for the file in errors.
StudyOptions read_study_text(const std::string& text, const std::string& name);

}  // namespace rugae
