#include "recon/dense/frame_poses.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "recon/dense/register_patch.h"
#include "recon/frames_between.h"
#include "recon/resection.h"
#include "recon/tracks.h"

namespace rugae {
namespace {

constexpr double kReferenceWidthPx = 640.0;
constexpr double kSearchPx = 16.0;         // around where a patch should be, at 640 px width
constexpr std::size_t kMostPatches = 300;  // looked for: more adds time and no precision
constexpr int kFramesAtOnce = 16;          // between two steps of the progress line

// Patches seen by any of the key frames, at most kMostPatches, spread over the list.
std::vector<const WallPatch*> seen_by(const std::vector<int>& keyframes,
                                      const std::vector<std::vector<int>>& patches_of,
                                      const std::vector<WallPatch>& patches) {
  std::vector<int> indices;
  for (const int k : keyframes)
    indices.insert(indices.end(), patches_of[k].begin(), patches_of[k].end());
  std::ranges::sort(indices);
  indices.erase(std::unique(indices.begin(), indices.end()), indices.end());
  const std::size_t stride = 1 + indices.size() / kMostPatches;
  std::vector<const WallPatch*> chosen;
  for (std::size_t i = 0; i < indices.size(); i += stride)
    chosen.push_back(&patches[static_cast<std::size_t>(indices[i])]);
  return chosen;
}

std::optional<Rigid3> place(const std::vector<const WallPatch*>& patches, const PatchImage& image,
                            const Rigid3& guess, const PatchRegistrar& registrar,
                            const LensProjector& projector, const Lens& lens,
                            const BundleOptions& options) {
  const double reach_px = kSearchPx * lens.width / kReferenceWidthPx;
  std::vector<Vec3> points;
  std::vector<Vec2> rays;
  for (const WallPatch* patch : patches) {
    const auto sight = foretell(*patch, guess, projector);
    if (!sight) continue;
    const auto pixel = registrar.find(*patch, *sight, image, reach_px);
    const auto ray = pixel ? ray_of(lens, *pixel) : std::nullopt;
    if (!ray) continue;
    points.push_back(patch->centre);
    rays.push_back(*ray);
  }
  const auto placed = place_by_points(points, rays, lens.fx, options);
  return placed ? std::optional(placed->cam_from_world) : std::nullopt;
}

}  // namespace

std::vector<std::optional<Rigid3>> place_frames(const FrameSource& frames,
                                                const Structure& structure,
                                                const std::vector<WallPatch>& patches,
                                                const BundleOptions& options, Progress& progress) {
  const int n = frames.size();
  std::vector<std::optional<Rigid3>> poses = keyframe_poses(structure, n);
  const std::vector<int> rest = without_pose(poses), placed = placed_keyframes(structure);
  progress.begin("frames between", rest.size());
  if (placed.empty()) {
    progress.end("nothing to place frames in");
    return poses;
  }
  std::vector<int> patch_of(structure.tracks.size(), -1);
  for (std::size_t p = 0; p < patches.size(); ++p)
    patch_of[static_cast<std::size_t>(patches[p].track)] = static_cast<int>(p);
  std::vector<std::vector<int>> patches_of(structure.frames.size());
  for (std::size_t t = 0; t < structure.tracks.size(); ++t)
    for (const auto& o : structure.tracks[t].observations)
      if (patch_of[t] >= 0) patches_of[o.keyframe].push_back(patch_of[t]);

  const PatchRegistrar registrar(frames.lens());
  const LensProjector projector(frames.lens());
  const cv::Mat none = cv::Mat::zeros(frames.valid().size(), CV_8U);
  for (std::size_t begin = 0; begin < rest.size(); begin += kFramesAtOnce) {
    const std::size_t end = std::min(rest.size(), begin + kFramesAtOnce);
    tbb::parallel_for(begin, end, [&](std::size_t i) {
      const int f = rest[i];
      const PatchImage image = prepare_patch_image({f, frames.gray(f), {}, none, frames.valid()});
      const Between around = between(structure, placed, f);
      std::vector<Rigid3> guesses;
      if (around.cam_from_world) guesses.push_back(*around.cam_from_world);
      for (const int k : around.keyframes) guesses.push_back(structure.cam_from_world[k]);
      const auto seen = seen_by(around.keyframes, patches_of, patches);
      for (const Rigid3& guess : guesses) {
        poses[f] = place(seen, image, guess, registrar, projector, frames.lens(), options);
        if (poses[f]) break;
      }
    });
    progress.step(end - begin);
  }
  const auto lost = std::ranges::count_if(poses, [](const auto& pose) { return !pose; });
  progress.end(fmt::format("{} of {} frames placed, {} lost", n - lost, n, lost));
  return poses;
}

}  // namespace rugae
