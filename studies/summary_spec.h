#pragma once
// What a study file asks to have made of its cells: tables, curves, bars and findings.

#include <string>
#include <vector>

#include "core/yaml.h"
#include "studies/axes.h"

namespace rugae {

/// A metric over two things that cells differ in: camera, trajectory, method, seed, or an axis.
struct TableSpec {
  std::string title, metric, unit;
  double scale = 1.0;  // of the metric, to get the unit
  std::string rows = "trajectory", columns = "camera";
  std::string published;    // a table of studies/published.yaml to stand beside ours
  std::string method = "";  // of its cells alone; empty: of all
};

/// A metric over an axis of numbers, such as the strength of a nuisance.
struct CurveSpec {
  std::string title, metric, unit;
  double scale = 1.0;
  std::string over;              // the axis
  std::string lines = "method";  // one line for each of these
};

/// A metric for each value of an axis.
struct BarsSpec {
  std::string title, metric, unit;
  double scale = 1.0;
  std::string over;
};

/// "The metric is larger there than here", over all else that cells differ in.
struct FindingSpec {
  struct Side {
    std::string what, value;  // of camera, trajectory, method, seed, or an axis
  };
  std::string claim, metric;
  Side more, less;
};

struct SummarySpecs {
  std::vector<TableSpec> tables;
  std::vector<CurveSpec> curves;
  std::vector<BarsSpec> bars;
  std::vector<FindingSpec> findings;
};

/// Reads `tables`, `curves`, `bars` and `findings`. `axes` and `methods` are the study's. Throws
/// Error with the place for something that cells do not differ in, a value an axis does not have, a
/// curve over an axis whose values are no numbers, and an unknown published table.
SummarySpecs read_summaries(YamlReader& study, const std::vector<Axis>& axes,
                            const std::vector<std::string>& methods);

}  // namespace rugae
