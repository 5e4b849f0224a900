#include "recon/stages.h"

#include <utility>

#include "recon/dense/frame_poses.h"
#include "recon/dense/linked_structure.h"
#include "recon/dense/metric_scale.h"
#include "recon/frame_follower.h"
#include "recon/resection.h"

namespace rugae {

Stages::Stages()
    : follow(follow_frames),
      structure([](const FrameSource& frames, const std::vector<int>& keyframes,
                   std::vector<Track> tracks, const ReconOptions& options, Progress& progress) {
        if (options.method != "dense")
          return build_structure(keyframes, std::move(tracks), frames.lens(), options.bundle,
                                 kFinalAdjustment, progress);
        Structure found = build_linked_structure(frames, keyframes, std::move(tracks),
                                                 options.revisits, options.bundle, progress);
        scale_by_light(frames, options.preprocess.reflections, found, progress);
        return found;
      }),
      resect([](const FrameSource& frames, const Structure& structure, const ReconOptions& options,
                Progress& progress) {
        if (options.method == "dense")
          return place_frames(frames, structure, make_patches(frames, structure), options.bundle,
                              progress);
        return resect_frames(frames, structure, options.align, options.bundle, options.seed,
                             progress);
      }),
      depth([](const Mosaic& mosaic, const Structure& structure, const Lens& lens,
               const ReconOptions& options) {
        return place_mosaic(mosaic, structure, lens, options.shading);
      }) {}

}  // namespace rugae
