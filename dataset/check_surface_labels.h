#pragma once
// Do the labels of the surface and of the light hold by themselves, and with each other?

#include <optional>
#include <set>
#include <vector>

#include "dataset/check_labels.h"

namespace rugae {

/// The numbers that truth/regions.csv and truth/instances.csv give names to. Throws Error naming
/// the file.
struct NamedNumbers {
  std::set<int> regions, instances;
};
NamedNumbers read_named_numbers(const DatasetLayout& layout);

/// Range and shading normals against depth, albedo between 0 and 1, light that is not negative and
/// whose parts add up to the radiance, numbers that have a name; of the labels that the frame has.
std::vector<LabelProblem> check_surface_labels(const LabelSources& sources,
                                               const NamedNumbers& named, int index);

}  // namespace rugae
