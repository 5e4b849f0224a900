#include "recon/mosaic.h"

#include <tbb/parallel_for.h>

#include "recon/blend.h"
#include "recon/mosaic_plan.h"

namespace rugae {

std::vector<Mosaic> compose_mosaics(const FrameSource& frames, const Structure& structure,
                                    const std::vector<PairAlignment>& pairs,
                                    const MosaicOptions& options) {
  options.check();
  const std::vector<MosaicPlan> plans = plan_mosaics(structure, pairs, frames.lens(), options);
  std::vector<Mosaic> mosaics(plans.size());
  // Side by side: most of what a picture takes runs on one thread.
  tbb::parallel_for(std::size_t{0}, plans.size(), [&](std::size_t i) {
    const MosaicPlan& plan = plans[i];
    std::vector<BlendInput> inputs;
    for (const MosaicMember& member : plan.members) {
      const Frame frame = frames.map_frame(structure.frames[member.keyframe]);
      inputs.push_back({frame.map_bgr, frame.valid, member.anchor_from_member});
    }
    const BlendResult blended = blend(inputs, mosaic_bounds(frames.lens()), options.bands);

    Mosaic& mosaic = mosaics[i];
    mosaic.anchor = plan.anchor;
    for (const MosaicMember& member : plan.members) mosaic.members.push_back(member.keyframe);
    mosaic.bgr = blended.bgr;
    mosaic.valid = blended.valid;
    mosaic.origin_px = blended.origin_px;
    mosaic.seams = cv::Mat(blended.seams.size(), CV_32S);
    for (int y = 0; y < mosaic.seams.rows; ++y)
      for (int x = 0; x < mosaic.seams.cols; ++x) {
        const int input = blended.seams.at<int>(y, x);
        mosaic.seams.at<int>(y, x) = input < 0 ? -1 : mosaic.members[input];
      }
  });
  return mosaics;
}

}  // namespace rugae
