#pragma once
// Intermediates of the pipeline for people: pictures/<stage>/<name>.png.

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "recon/dense/dense_map.h"
#include "recon/map.h"
#include "recon/mosaic.h"
#include "recon/preprocess/preprocess.h"
#include "recon/structure.h"

namespace rugae {

/// Writes into <folder>/<stage>; every function takes what the stage made and nothing else.
/// preprocess: original, mask, inpainted and final picture of some frames, the vignetting gain.
void draw_preprocess(const std::filesystem::path& folder, const FrameSource& frames,
                     const std::vector<int>& indices, const PreprocessOptions& options);
/// flow and inliers: for the pairs that have correspondences, the flow and these over the reference
/// frame.
void draw_pairs(const std::filesystem::path& folder, const FrameSource& frames,
                const std::vector<PairAlignment>& pairs);
/// tracks: the points of some key frames over them, coloured by the number of key frames that see
/// them.
void draw_tracks(const std::filesystem::path& folder, const FrameSource& frames,
                 const Structure& structure, const std::vector<int>& keyframes);
/// mosaic and depth: each mosaic, with the seams drawn in, and its depth.
void draw_mosaics(const std::filesystem::path& folder, const std::vector<Mosaic>& mosaics,
                  const std::vector<std::optional<MosaicDepth>>& depths, std::size_t at_most);

/// links: for each two key frames, in the order of time, how many points both see (logarithmic,
/// black for none). A chain is a diagonal; what is off it was seen again.
void draw_links(const std::filesystem::path& folder, const Structure& structure);
/// wide, stereo, agreed and sigma: some key frames, their depth as stereo found it, what other
/// depth maps agree with, and its sigma over the depth, up to `max_sigma_share`.
void draw_depth_maps(const std::filesystem::path& folder, const std::vector<DepthExample>& examples,
                     double max_sigma_share);

}  // namespace rugae
