#pragma once
// One frame as light falls on the sensor, with its truth.

#include <atomic>
#include <opencv2/core/mat.hpp>
#include <string>

#include "dataset/truth.h"
#include "render/labels.h"
#include "render/lens_samples.h"
#include "render/motion.h"
#include "render/path_trace.h"
#include "render/surface.h"

namespace rugae {

/// Processor seconds of all threads, summed over frames.
struct RenderTimes {
  std::atomic<double> trace_s = 0.0, shade_s = 0.0, label_s = 0.0;
};

struct RenderOptions {
  bool vignetting = true;
  LabelSet labels = {};
  PathOptions paths = {};       // of light that comes over other walls
  bool keep_materials = false;  // for gather
  std::string device = {};      // the Raycaster's; no result depends on it
  bool highlights = true;       // the lights mirrored by the wet layer
};

struct CleanFrame {
  cv::Mat radiance;  // CV_32FC3, linear RGB, after vignetting; 0 where nothing was hit
  FrameTruth truth;  // the wanted labels, and masks in any case; the saturated bit is the sensor's
                     // to set
  std::vector<PixelMaterial> materials;  // one a pixel, where they are kept
};

class FrameRenderer {
 public:
  /// Keeps a reference: the scene must outlive it.
  FrameRenderer(const Scene& scene, const Camera& camera, const RenderOptions& options);
  /// Any wall and material.
  FrameRenderer(Surface surface, const Camera& camera, const RenderOptions& options);

  /// The sharp frame: each row as it is in the middle of its exposure. `previous` and `next` are
  /// the frames beside it, null where there is none. Tiles are shared among the threads of the
  /// caller's arena; the result does not depend on how.
  CleanFrame render(const FrameView& now, const FrameView* previous, const FrameView* next,
                    RenderTimes* times = nullptr) const;
  /// With a global shutter and a wall that keeps still; `index` is the frame's.
  CleanFrame render(const Rigid3& world_from_camera, const Rigid3* next,
                    RenderTimes* times = nullptr, int index = 0) const;

  /// The radiance alone (CV_32FC3, as in CleanFrame), gathered over pixel, aperture and exposure:
  /// the mean of the samples. With the materials of the sharp frame those are looked up once a
  /// pixel and not once a sample, where the samples meet the wall within its footprint.
  cv::Mat gather(const FrameView& now, const LensSampling& sampling, RenderTimes* times = nullptr,
                 std::span<const PixelMaterial> materials = {}) const;

  bool needs_previous() const { return options_.labels.backward_flow; }
  bool needs_next() const { return options_.labels.flow; }
  const RayTable& rays() const { return rays_; }
  const LensProjector& lens() const { return lens_; }
  const Wall& wall() const { return wall_; }  // at rest
  const Wall& wall_of(const FrameView& view) const { return view.wall ? *view.wall : wall_; }

 private:
  Wall wall_;
  Camera camera_;
  RenderOptions options_;
  RayTable rays_;
  LensProjector lens_;
};

}  // namespace rugae
