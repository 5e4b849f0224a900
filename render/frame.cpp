#include "render/frame.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <memory>
#include <optional>

#include "render/radiance.h"
#include "render/thread_clock.h"

namespace rugae {
namespace {

struct Scratch {
  Tile tile;
  SurfaceTile surface;
  RadianceTile radiance;
  Lanes<Vec3f> indirect;
  PathTracer paths;

  explicit Scratch(const PathOptions& options) : paths(options) {}
};

// Linear RGB of lane k of the surface, before vignetting.
Vec3f light_of(const Scratch& s, int k, const RenderOptions& options) {
  Vec3f all =
      s.radiance.wall[k] * s.surface.material[k].albedo + Vec3f::Constant(s.radiance.coat[k]);
  if (options.paths.bounces > 0) all += s.indirect[k];
  return all;
}

void store(const Scratch& s, const RayTable& rays, const RenderOptions& options,
           CleanFrame& frame) {
  auto* out = frame.radiance.ptr<Vec3f>();
  auto* masks = frame.truth.masks.ptr<unsigned char>();
  for (int k = 0; k < s.surface.count; ++k) {
    const int i = s.tile.pixel[s.surface.lane[k]];
    const float light = options.vignetting ? rays.vignetting[i] : 1.0f;
    const Vec3f all = light_of(s, k, options);
    out[i] = light * all;
    masks[i] |= kMaskValid;
    if (s.radiance.coat[k] > kSpecularShare * luminance(all.x(), all.y(), all.z()))
      masks[i] |= kMaskSpecular;
  }
}

}  // namespace

FrameRenderer::FrameRenderer(const Scene& scene, const Camera& camera, const RenderOptions& options)
    : FrameRenderer(Surface(scene), camera, options) {}

FrameRenderer::FrameRenderer(Surface surface, const Camera& camera, const RenderOptions& options)
    : wall_(std::move(surface), options.device),
      camera_(camera),
      options_(options),
      rays_(make_ray_table(camera.lens, camera.vignetting)),
      lens_(camera.lens) {}

CleanFrame FrameRenderer::render(const FrameView& now, const FrameView* previous,
                                 const FrameView* next, RenderTimes* times) const {
  CleanFrame frame;
  frame.radiance = cv::Mat(rays_.height, rays_.width, CV_32FC3, cv::Scalar::all(0.0));
  if (options_.labels)
    frame.truth = empty_truth(rays_.width, rays_.height, previous != nullptr, next != nullptr,
                              options_.choice);
  else
    frame.truth.masks = cv::Mat(rays_.height, rays_.width, CV_8U, cv::Scalar(0));

  const Wall& wall = wall_of(now);
  std::optional<OtherFrame> before, after;
  if (previous && options_.choice.backward_flow)
    before.emplace(OtherFrame{*previous, wall_of(*previous)});
  if (next) after.emplace(OtherFrame{*next, wall_of(*next)});
  const LabelView view{wall, before ? &*before : nullptr, after ? &*after : nullptr};

  const std::vector<Instant> instants = now.instants(rays_.height);
  const int columns = (rays_.width + kTileWidth - 1) / kTileWidth;
  const int rows = (rays_.height + kTileHeight - 1) / kTileHeight;
  tbb::parallel_for(tbb::blocked_range<int>(0, columns * rows, 4), [&](const auto& range) {
    const auto s = std::make_unique<Scratch>(options_.paths);
    for (int t = range.begin(); t < range.end(); ++t) {
      const double start = thread_seconds();
      place_tile(rays_, instants, t % columns * kTileWidth, t / columns * kTileHeight, s->tile);
      const auto n = static_cast<std::size_t>(s->tile.count);
      wall.raycaster().intersect(s->tile.eyes(), {s->tile.direction_world.data(), n},
                                 {s->tile.hit.data(), n});
      const double traced = thread_seconds();
      wall.surface().look_up(s->tile, rays_, s->surface);
      shade(camera_.lights, wall, s->tile, s->surface, s->radiance);
      if (options_.paths.bounces > 0)
        s->paths.trace(camera_.lights, wall, s->tile, s->surface,
                       static_cast<std::uint32_t>(now.index), s->indirect);
      store(*s, rays_, options_, frame);
      const double shaded = thread_seconds();
      if (options_.labels) label_tile(s->tile, rays_, lens_, view, frame.truth);
      if (times) {
        times->trace_s += traced - start;
        times->shade_s += shaded - traced;
        times->label_s += thread_seconds() - shaded;
      }
    }
  });
  return frame;
}

cv::Mat FrameRenderer::gather(const FrameView& now, const LensSampling& sampling,
                              RenderTimes* times) const {
  cv::Mat radiance(rays_.height, rays_.width, CV_32FC3, cv::Scalar::all(0.0));
  const Wall& wall = wall_of(now);
  const LensSampler sampler(rays_, now, sampling);
  const int columns = (rays_.width + kTileWidth - 1) / kTileWidth;
  const int rows = (rays_.height + kTileHeight - 1) / kTileHeight;
  tbb::parallel_for(0, columns * rows, [&](int t) {
    const auto s = std::make_unique<Scratch>(options_.paths);
    auto* out = radiance.ptr<Vec3f>();
    for (int k = 0; k < sampling.samples; ++k) {
      const double start = thread_seconds();
      sampler.place(k, t % columns * kTileWidth, t / columns * kTileHeight, s->tile);
      const auto n = static_cast<std::size_t>(s->tile.count);
      wall.raycaster().intersect(s->tile.eyes(), {s->tile.direction_world.data(), n},
                                 {s->tile.hit.data(), n});
      const double traced = thread_seconds();
      wall.surface().look_up(s->tile, rays_, s->surface);
      shade(camera_.lights, wall, s->tile, s->surface, s->radiance);
      // Paths of another sample are those of another frame: samples below 2^12, frames below 2^20.
      if (options_.paths.bounces > 0)
        s->paths.trace(
            camera_.lights, wall, s->tile, s->surface,
            static_cast<std::uint32_t>(now.index) + (static_cast<std::uint32_t>(k) << 20),
            s->indirect);
      for (int i = 0; i < s->surface.count; ++i)
        out[s->tile.pixel[s->surface.lane[i]]] += light_of(*s, i, options_);
      if (times) {
        times->trace_s += traced - start;
        times->shade_s += thread_seconds() - traced;
      }
    }
    const float share = 1.0f / static_cast<float>(sampling.samples);
    for (int lane = 0; lane < s->tile.count; ++lane) {
      const int i = s->tile.pixel[lane];
      out[i] *= options_.vignetting ? share * rays_.vignetting[i] : share;
    }
  });
  return radiance;
}

CleanFrame FrameRenderer::render(const Rigid3& world_from_camera, const Rigid3* next,
                                 RenderTimes* times, int index) const {
  FrameView now, after;
  now.index = index;
  now.camera = RowPoses(world_from_camera);
  if (next) after.camera = RowPoses(*next);
  return render(now, nullptr, next ? &after : nullptr, times);
}

}  // namespace rugae
