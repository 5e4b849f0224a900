#include "studies/cell.h"

#include "core/check.h"

namespace rugae {

std::string stem(const std::string& name_or_path) {
  return std::filesystem::path(name_or_path).stem().string();
}

std::string Cell::name() const {
  std::string name = part.empty() ? "" : part + "_";
  name += fmt::format("{}_{}_{}", stem(camera), stem(trajectory), method);
  if (!settings.empty()) name += fmt::format("_v{}", variant + 1);
  if (one_of_seeds) name += fmt::format("_seed{}", seed);
  return name;
}

std::string Cell::setting() const {
  std::string text = shown(settings);
  if (one_of_seeds) text += fmt::format("{}seed {}", text.empty() ? "" : ", ", seed);
  return text;
}

std::string Cell::title() const {
  const std::string more = setting();
  return fmt::format("{}{}, trajectory {}, {}{}", part.empty() ? "" : part + ": ", stem(camera),
                     stem(trajectory), method, more.empty() ? "" : ", " + more);
}

std::vector<Cell> cells_of(const StudyOptions& study) {
  std::vector<Cell> cells;
  for (const std::string& camera : study.cameras)
    for (const std::string& trajectory : study.trajectories)
      for (int v = 0; v < static_cast<int>(study.variants.size()); ++v)
        for (const std::uint64_t seed : study.seeds)
          for (const std::string& method : study.methods)
            cells.push_back({camera, trajectory, method, study.variants[v].settings, seed,
                             study.seeds.size() > 1, v, study.name});
  return cells;
}

}  // namespace rugae
