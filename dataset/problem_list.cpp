#include "dataset/problem_list.h"

#include <set>

#include "dataset/layout.h"
#include "dataset/manifest.h"

namespace rugae {
namespace fs = std::filesystem;

void check_manifest(const fs::path& root, ProblemList& problems) {
  const fs::path manifest = DatasetLayout{root}.manifest();
  const auto expected = problems.attempt([&] { return read_manifest(manifest); });
  if (!expected) return;
  const auto files = files_below(root, manifest.filename().string());
  const std::set<std::string> present(files.begin(), files.end());
  for (const auto& [file, hash] : *expected)
    if (!present.contains(file)) problems.note((root / file).string() + ": missing");
  const auto hashes = hashes_of(root, files);
  for (std::size_t i = 0; i < files.size(); ++i) {
    const auto entry = expected->find(files[i]);
    const std::string name = (root / files[i]).string();
    if (entry == expected->end())
      problems.note(name + ": not in the manifest");
    else if (entry->second != hashes[i])
      problems.note(
          fmt::format("{}: changed since it was written (SHA-256 {}..., the manifest says {}...)",
                      name, hashes[i].substr(0, 8), entry->second.substr(0, 8)));
  }
}

void check_moves(const PoseTrack& track, const std::string& name, ProblemList& problems) {
  if (track.size() < 2) return;
  constexpr double kMoves = 1e-6;  // from the first pose: mm and rad
  const Rigid3& first = track.front().world_from_camera;
  const bool moves = std::ranges::any_of(track, [&first](const TimedPose& pose) {
    const Rigid3& p = pose.world_from_camera;
    return (p.translation - first.translation).norm() > kMoves ||
           angle_between_rad(p.rotation, first.rotation) > kMoves;
  });
  if (!moves)
    problems.note(fmt::format("{}: the camera never moves: {} equal poses", name, track.size()));
}

}  // namespace rugae
