#pragma once
// A frame's pose from points that are already known: how key frames join the structure, and how all
// other frames find their place in it.

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/progress.h"
#include "core/rigid3.h"
#include "recon/options.h"
#include "recon/preprocess/preprocess.h"
#include "recon/structure.h"

namespace rugae {

struct Placement {
  Rigid3 cam_from_world;
  std::vector<char> inlier;  // of each point
  int inliers = 0;
};

/// Pose from known points (world) and the rays that see them: perspective-n-point within RANSAC
/// (Gao et al., TPAMI 2003, doi:10.1109/TPAMI.2003.1217599; minimal samples), then refinement on
/// the inliers with a Huber loss. Empty with fewer than `min_resection_inliers` inliers, or when
/// fewer than a quarter of the points agree.
std::optional<Placement> place_by_points(const std::vector<Vec3>& points,
                                         const std::vector<Vec2>& rays, double focal_px,
                                         const BundleOptions& options);

/// Places frames one by one: the points of the placed key frames next to a frame are followed into
/// it by `align`. Key frames are prepared once for many frames.
class Resector {
 public:
  Resector(const FrameSource& frames, const AlignOptions& align_options,
           const BundleOptions& options, std::uint64_t seed);
  ~Resector();

  /// cam_from_world; empty where following fails, or where no key frame is placed.
  std::optional<Rigid3> place(const Structure& structure, int frame) const;

 private:
  friend std::vector<std::optional<Rigid3>> resect_frames(const FrameSource&, const Structure&,
                                                          const AlignOptions&, const BundleOptions&,
                                                          std::uint64_t, Progress&);
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Poses of all frames that are not placed key frames: the points of the nearest placed key frames
/// before and after are followed into the frame by `align`. Empty where that fails: the frame is
/// lost. cam_from_world; key frames keep their pose.
std::vector<std::optional<Rigid3>> resect_frames(const FrameSource& frames,
                                                 const Structure& structure,
                                                 const AlignOptions& align_options,
                                                 const BundleOptions& options, std::uint64_t seed,
                                                 Progress& progress);

}  // namespace rugae
