#pragma once
// Local mosaics, the paper's algorithm 3, steps 8 to 10: warping onto the anchor, gain
// compensation, multi-band blending.

#include <opencv2/core/mat.hpp>
#include <vector>

#include "recon/mosaic_plan.h"
#include "recon/options.h"
#include "recon/preprocess/preprocess.h"
#include "recon/structure.h"

namespace rugae {

/// A plane cannot hold a cavity: key frames whose view is within about 45 degrees of an anchor's
/// form one mosaic on the anchor's image plane.
struct Mosaic {
  int anchor = -1;                // key frame position
  std::vector<int> members;       // key frame positions, anchor included
  cv::Mat bgr;                    // CV_8UC3
  cv::Mat valid;                  // CV_8U
  cv::Mat seams;                  // CV_32S, the member each pixel came from, -1 outside
  Vec2 origin_px = Vec2::Zero();  // anchor pixel = mosaic pixel + origin
};

Mosaic compose_mosaic(const FrameSource& frames, const Structure& structure, const MosaicPlan& plan,
                      const MosaicOptions& options);

}  // namespace rugae
