#include "render/frame.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

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
  LensSampler::Pixels pixels;
  std::optional<PathTracer> paths;  // where there are bounces

  explicit Scratch(const PathOptions& options) {
    if (options.bounces > 0) paths.emplace(options);
  }
};
// One a thread: they are large.
using Scratches = tbb::enumerable_thread_specific<Scratch>;

// Linear RGB towards the camera, before vignetting, by what the light met last.
struct Light {
  Vec3f diffuse, indirect;
  float specular;
  Vec3f all() const { return diffuse + Vec3f::Constant(specular) + indirect; }
};

Light light_of(const Scratch& s, int k, const RenderOptions& options) {
  return {s.radiance.wall[k] * s.surface.material[k].albedo,
          options.paths.bounces > 0 ? s.indirect[k] : Vec3f(Vec3f::Zero()),
          options.highlights ? s.radiance.coat[k] : 0.0f};
}

void store(const Scratch& s, const RayTable& rays, const RenderOptions& options,
           CleanFrame& frame) {
  auto* const out = frame.radiance.ptr<Vec3f>();
  auto* const masks = frame.truth.masks.ptr<unsigned char>();
  auto* const diffuse = pixels<Vec3f>(frame.truth.diffuse);
  auto* const specular = pixels<float>(frame.truth.specular);
  auto* const indirect = pixels<Vec3f>(frame.truth.indirect);
  for (int k = 0; k < s.surface.count; ++k) {
    const int i = s.tile.pixel[s.surface.lane[k]];
    const float through = options.vignetting ? rays.vignetting[i] : 1.0f;
    const Light light = light_of(s, k, options);
    const Vec3f all = light.all();
    out[i] = through * all;
    if (diffuse) diffuse[i] = through * light.diffuse;
    if (specular) specular[i] = through * light.specular;
    if (indirect) indirect[i] = through * light.indirect;
    masks[i] |= kMaskValid;
    if (light.specular > kSpecularShare * luminance(all.x(), all.y(), all.z()))
      masks[i] |= kMaskSpecular;
  }
}

// For the rays that met no wall.
void store_nothing(const Tile& tile, CleanFrame& frame) {
  for (int lane = 0; lane < tile.count; ++lane)
    if (!tile.hit[lane].met()) frame.radiance.ptr<Vec3f>()[tile.pixel[lane]].setZero();
  label_nothing(tile, frame.truth);
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
  frame.radiance.create(rays_.height, rays_.width, CV_32FC3);  // every pixel is in a tile
  frame.truth =
      new_truth(rays_.width, rays_.height, previous != nullptr, next != nullptr, options_.labels);

  if (options_.keep_materials) frame.materials.resize(rays_.size());
  const Wall& wall = wall_of(now);
  std::optional<OtherFrame> before, after;
  if (previous && options_.labels.backward_flow)
    before.emplace(OtherFrame{*previous, wall_of(*previous)});
  if (next && options_.labels.flow) after.emplace(OtherFrame{*next, wall_of(*next)});
  const LabelView view{wall, before ? &*before : nullptr, after ? &*after : nullptr};

  const bool labelled = options_.labels != LabelSet::none();
  const std::vector<Instant> instants = now.instants(rays_.height);
  const int columns = (rays_.width + kTileWidth - 1) / kTileWidth;
  const int rows = (rays_.height + kTileHeight - 1) / kTileHeight;
  Scratches scratches(options_.paths);
  tbb::parallel_for(tbb::blocked_range<int>(0, columns * rows, 4), [&](const auto& range) {
    Scratch* const s = &scratches.local();
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
        s->paths->trace(camera_.lights, wall, s->tile, s->surface,
                        static_cast<std::uint32_t>(now.index), s->indirect);
      if (s->surface.count < s->tile.count) store_nothing(s->tile, frame);
      store(*s, rays_, options_, frame);
      if (options_.keep_materials)
        for (int k = 0; k < s->surface.count; ++k)
          frame.materials[static_cast<std::size_t>(s->tile.pixel[s->surface.lane[k]])] = {
              s->surface.query[k].rest_position_mm, s->surface.material[k], true};
      const double shaded = thread_seconds();
      if (labelled) {
        label_tile(s->tile, rays_, lens_, view, frame.truth);
        label_surface(s->tile, s->surface, frame.truth);
      }
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
                              RenderTimes* times, std::span<const PixelMaterial> materials) const {
  cv::Mat radiance(rays_.height, rays_.width, CV_32FC3, cv::Scalar::all(0.0));
  const Wall& wall = wall_of(now);
  const LensSampler sampler(rays_, now, sampling);
  const int columns = (rays_.width + kTileWidth - 1) / kTileWidth;
  const int rows = (rays_.height + kTileHeight - 1) / kTileHeight;
  Scratches scratches(options_.paths);
  tbb::parallel_for(0, columns * rows, [&](int t) {
    Scratch* const s = &scratches.local();
    auto* out = radiance.ptr<Vec3f>();
    sampler.begin(t % columns * kTileWidth, t / columns * kTileHeight, s->tile, s->pixels);
    for (int k = 0; k < sampling.samples; ++k) {
      const double start = thread_seconds();
      sampler.place(k, s->pixels, s->tile);
      const auto n = static_cast<std::size_t>(s->tile.count);
      wall.raycaster().intersect(s->tile.eyes(), {s->tile.direction_world.data(), n},
                                 {s->tile.hit.data(), n});
      const double traced = thread_seconds();
      wall.surface().look_up(s->tile, rays_, s->surface, materials);
      shade(camera_.lights, wall, s->tile, s->surface, s->radiance);
      // Paths of another sample are those of another frame: samples below 2^12, frames below 2^20.
      if (options_.paths.bounces > 0)
        s->paths->trace(
            camera_.lights, wall, s->tile, s->surface,
            static_cast<std::uint32_t>(now.index) + (static_cast<std::uint32_t>(k) << 20),
            s->indirect);
      for (int i = 0; i < s->surface.count; ++i)
        out[s->tile.pixel[s->surface.lane[i]]] += light_of(*s, i, options_).all();
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
