#pragma once
// Stages of the reconstruction by one who knows the truth, to see how much of the error each of
// ours is guilty of. The reconstruction is handed them through Stages, like any other.

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "recon/stages.h"

namespace rugae {

/// What of the reconstruction the truth takes the place of.
enum class Replace {
  nothing,
  lens,             // the true calibration
  frames,           // without noise, highlights, vignetting and blur
  correspondences,  // of pairs, tracks and frames between: the same points, where they truly are
  poses,            // of all frames; points are triangulated from our tracks
  depth,            // of the mosaics, where ours has any
};
/// Their names in a study file.
const std::vector<std::string>& replace_names();

/// The stages that `replace` asks for, for frames of this dataset; those of the paper for the rest.
/// `lens` is the one that the reconstruction uses, which need not be the true one.
Stages stages_with(Replace replace, const std::filesystem::path& dataset, const Lens& lens);

}  // namespace rugae
