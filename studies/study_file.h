#pragma once
// What a study file asks for.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "studies/external.h"
#include "studies/summary_spec.h"
#include "studies/variant.h"

namespace rugae {

/// A bound on a metric, for every cell it names (all, where it names nothing).
struct Gate {
  std::string metric;  // a path into a cell's metrics, such as "trajectory.ate_sim3_rmse_mm"
  std::optional<double> above, below;
  std::string reason;
  std::vector<std::string> camera, trajectory, method;  // any of these; empty: all
  std::vector<Setting> settings;                        // those it names must be the cell's
};

/// What a cell is: the whole loop, or a single stage of it against the truth (studies/measure.h).
enum class Measure { loop, features, reflections, vignetting };
const std::vector<std::string>& measure_names();

/// What stays of a cell that is measured: all of it, or its metrics and one frame.
enum class Keep { all, results };
const std::vector<std::string>& keep_names();

/// Which pairs of frames features are measured on.
struct FeaturePairs {
  int step = 1;    // pairs (i, i + step)
  int stride = 1;  // of every so many frames i
};

/// Keys of the file have the same names; `frames`, `scene`, `resolution` and `render` go to
/// `simulate`.
struct StudyOptions {
  std::string name;  // of a part: the stem of its file; empty for a study without parts
  std::string title = "A stomach, simulated and reconstructed";
  std::vector<std::string> cameras, trajectories, methods{"paper"};
  std::vector<ExternalMethod> commands;  // methods that are programs of their own
  std::vector<std::uint64_t> seeds{1};   // each draws the stomach, the paths and the noise anew
  std::vector<Variant> variants{1};      // at least one
  std::vector<Gate> gates;
  SummarySpecs summaries;
  Measure measure = Measure::loop;  // of features the methods are feature methods
  FeaturePairs features;
  bool details = true;  // of each cell in the report, not its row in the tables alone; of the loop
  Keep keep = Keep::all;
  bool alone = false;  // each cell has the machine to itself: its time is what is asked for
  std::string text;    // as it was read

  /// Null for a method of ours.
  const ExternalMethod* command_of(const std::string& method) const;
};

/// A study, or several that make one report.
struct Study {
  std::string title;
  std::string text;  // of the file
  std::vector<StudyOptions> parts;
};

/// Reads a study file: one study, or with the key `parts` a list of other files or presets, each
/// with changes of its own. Throws Error with file, line and column for an unknown key, a wrong
/// type, a value out of range, a preset that does not exist, a gate without a bound or a reason, or
/// an axis whose path or value the file itself could not hold.
Study read_study(const std::filesystem::path& file);
/// The same from text; `name` stands for the file in errors.
Study read_study_text(const std::string& text, const std::string& name);
/// A study without parts.
StudyOptions read_part_text(const std::string& text, const std::string& name);

}  // namespace rugae
