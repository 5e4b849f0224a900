#pragma once
// Millimetres from light.

#include "core/progress.h"
#include "recon/options.h"
#include "recon/preprocess/preprocess.h"
#include "recon/structure.h"

namespace rugae {

/// Where the calibration says of lights beside the camera (Observations::lights) and they show how
/// large the world is (light_scale.h), the structure's unit becomes the millimetre and its
/// `scale_sigma_share` is set. Nothing changes elsewhere. Poses and points are taken as they are.
void scale_by_light(const FrameSource& frames, const ReflectionOptions& reflections,
                    Structure& structure, Progress& progress);

}  // namespace rugae
