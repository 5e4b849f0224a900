#pragma once
// Reconstruction: observations in, estimate out. Never truth.

#include <filesystem>
#include <string>

#include "core/progress.h"
#include "dataset/estimate.h"
#include "dataset/observations.h"
#include "recon/options.h"

namespace rugae {

/// Runs the method and writes the estimate's folder (depth and pictures as it goes). Throws Error
/// for fewer than two usable frames; frames that cannot be placed are `lost`, not errors.
Estimate reconstruct(const Observations& observations, const ReconOptions& options,
                     const std::filesystem::path& out, Progress& progress);

}  // namespace rugae
