#pragma once
// `rugae check` for a folder that rugae did not make.

#include "dataset/check_dataset.h"
#include "dataset/plain_folder.h"

namespace rugae {

/// Checks the manifest where there is one, that images, depth, flow and masks decode, agree in size
/// with the calibration and in number with each other, that depth is there and varies, that flow is
/// not clamped, that masks promise what depth holds, that poses are rotations that move; and, from
/// a sample of frames, that depth, poses, flow and colour belong together (dataset/diagnose.h).
/// Throws Error when there is no folder of images, or something that was named is not there.
DatasetCheck check_folder(const std::filesystem::path& root, const PlainFolderOptions& options);

}  // namespace rugae
