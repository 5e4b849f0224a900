#pragma once
// One frame as light falls on the sensor, with its truth.

#include <atomic>
#include <opencv2/core/mat.hpp>

#include "dataset/truth.h"
#include "render/labels.h"
#include "render/light.h"
#include "render/raycaster.h"
#include "render/surface.h"

namespace rugae {

/// Processor seconds of all threads, summed over frames.
struct RenderTimes {
  std::atomic<double> trace_s = 0.0, shade_s = 0.0, label_s = 0.0;
};

struct RenderOptions {
  bool vignetting = true;
  bool labels = true;
};

struct CleanFrame {
  cv::Mat radiance;  // CV_32FC3, linear RGB, after vignetting; 0 where nothing was hit
  FrameTruth truth;  // the saturated bit is the sensor's to set; empty matrices without labels,
                     // but for the masks
};

class FrameRenderer {
 public:
  /// Keeps a reference: the scene must outlive it.
  FrameRenderer(const Scene& scene, const Camera& camera, const RenderOptions& options);
  /// Any wall and material.
  FrameRenderer(Surface surface, const Camera& camera, const RenderOptions& options);

  /// `next` is the following frame's pose, null for the last. Tiles are shared among the threads of
  /// the caller's arena; the result does not depend on how.
  CleanFrame render(const Rigid3& world_from_camera, const Rigid3* next,
                    RenderTimes* times = nullptr) const;

  const RayTable& rays() const { return rays_; }
  const Raycaster& raycaster() const { return raycaster_; }

 private:
  Surface surface_;
  Camera camera_;
  RenderOptions options_;
  RayTable rays_;
  Raycaster raycaster_;
  LensProjector lens_;
  PointLight light_;
};

}  // namespace rugae
