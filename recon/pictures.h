#pragma once
// Intermediates of the pipeline for people: pictures/<stage>/<name>.png.

#include <opencv2/core/mat.hpp>
#include <vector>

#include "recon/dense/dense_map.h"
#include "recon/listener.h"
#include "recon/mosaic_map.h"
#include "recon/preprocess/preprocess.h"
#include "recon/structure.h"

namespace rugae {

/// Each picture goes to the sink, named <stage>/<name>.png; every function takes what the stage
/// made and nothing else. preprocess: original, mask, inpainted and final picture of some frames,
/// the vignetting gain.
void draw_preprocess(const PictureSink& sink, const FrameSource& frames,
                     const std::vector<int>& indices, const PreprocessOptions& options);
/// flow and inliers: for the pairs that have correspondences, the flow and these over the reference
/// frame.
void draw_pairs(const PictureSink& sink, const FrameSource& frames,
                const std::vector<PairAlignment>& pairs);
/// tracks: the points of some key frames over them, coloured by the number of key frames that see
/// them.
void draw_tracks(const PictureSink& sink, const FrameSource& frames, const Structure& structure,
                 const std::vector<int>& keyframes);
/// followed: one key frame while frames come; of each track through it where it is, and how many
/// key frames have seen it.
struct FollowedPoint {
  Vec2 pixel;
  std::size_t keyframes = 0;
};
void draw_followed(const PictureSink& sink, const cv::Mat& gray, int frame,
                   const std::vector<FollowedPoint>& points);
/// mosaic and depth: each mosaic, with the seams drawn in, and its depth.
void draw_mosaics(const PictureSink& sink, const std::vector<MosaicExample>& examples);

/// links: for each two key frames, in the order of time, how many points both see (logarithmic,
/// black for none). A chain is a diagonal; what is off it was seen again.
void draw_links(const PictureSink& sink, const Structure& structure);
/// wide, stereo, agreed and sigma: some key frames, their depth as stereo found it, what other
/// depth maps agree with, and its sigma over the depth, up to `max_sigma_share`.
void draw_depth_maps(const PictureSink& sink, const std::vector<DepthExample>& examples,
                     double max_sigma_share);

}  // namespace rugae
