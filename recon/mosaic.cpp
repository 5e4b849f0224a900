#include "recon/mosaic.h"

#include "recon/blend.h"

namespace rugae {

Mosaic compose_mosaic(const FrameSource& frames, const Structure& structure, const MosaicPlan& plan,
                      const MosaicOptions& options) {
  options.check();
  std::vector<BlendInput> inputs;
  for (const MosaicMember& member : plan.members) {
    const Frame frame = frames.map_frame(structure.frames[member.keyframe]);
    inputs.push_back({frame.map_bgr, frame.valid, member.anchor_from_member});
  }
  const BlendResult blended = blend(inputs, mosaic_bounds(frames.lens()), options.bands);

  Mosaic mosaic;
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
  return mosaic;
}

}  // namespace rugae
