// What a frame costs, stage by stage, at 640 x 480: `bench_render --benchmark_counters_tabular`.
// Peers side by side: the same primary rays through Embree alone, and one by one.
#include <benchmark/benchmark.h>

#include <memory>

#include "bare_embree.h"
#include "render/frame.h"
#include "render/sensor.h"
#include "scenes/scene.h"

namespace {

using namespace rugae;

struct Stage {
  Scene scene = load_scene({.name_or_path = "stomach", .seed = 1, .resolution = "medium"});
  Camera camera = load_camera("misumi-v5506");
  FrameRenderer renderer{scene, camera, {}};
  Rigid3 pose, next;

  Stage() {
    // The mean of the vertices of the body lies well inside it.
    Vec3 sum = Vec3::Zero();
    int count = 0;
    for (std::size_t i = 0; i < scene.wall.vertices.size(); ++i)
      if (scene.regions[i] == Region::body) {
        sum += scene.wall.vertices[i];
        ++count;
      }
    pose.translation = sum / std::max(1, count);
    next = pose;
    next.translation += Vec3(0.4, 0.2, 0.1);
  }
};

Stage& stage() {
  static Stage stage;
  return stage;
}

void primary_rays(benchmark::State& state) {
  const Stage& s = stage();
  const auto& rays = s.renderer.rays().directions_cam;
  std::vector<Hit> hits(rays.size());
  for (auto _ : state) s.renderer.wall().raycaster().intersect(s.pose.translation, rays, hits);
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(rays.size()));
}
BENCHMARK(primary_rays)->Unit(benchmark::kMillisecond);

// 100 % is what Embree's packets reach when nobody asks where in the triangle the ray landed.
void bare_embree_packets(benchmark::State& state) {
  const Stage& s = stage();
  const auto& rays = s.renderer.rays().directions_cam;
  bench::BareEmbree embree(s.scene.wall, s.pose.translation, rays);
  for (auto _ : state) benchmark::DoNotOptimize(embree.trace());
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(rays.size()));
}
BENCHMARK(bare_embree_packets)->Unit(benchmark::kMillisecond);

void primary_rays_one_by_one(benchmark::State& state) {
  const Stage& s = stage();
  const auto& rays = s.renderer.rays().directions_cam;
  for (auto _ : state)
    for (const Vec3& ray : rays)
      benchmark::DoNotOptimize(s.renderer.wall().raycaster().intersect(s.pose.translation, ray));
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(rays.size()));
}
BENCHMARK(primary_rays_one_by_one)->Unit(benchmark::kMillisecond);

void mucosa_samples(benchmark::State& state) {
  const Stage& s = stage();
  const auto& wall = s.scene.wall;
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(s.scene.mucosa.sample(s.scene.rest_positions[i].cast<float>(),
                                                   wall.normals[i], s.scene.regions[i], 0.1f));
    i = (i + 1) % wall.vertices.size();
  }
}
BENCHMARK(mucosa_samples);

void frame_with_truth(benchmark::State& state) {
  const Stage& s = stage();
  RenderTimes times;
  for (auto _ : state) benchmark::DoNotOptimize(s.renderer.render(s.pose, &s.next, &times));
  const auto per_frame_ms = [&](double seconds) {
    return benchmark::Counter(1e3 * seconds, benchmark::Counter::kAvgIterations);
  };
  state.counters["trace_ms"] = per_frame_ms(times.trace_s);
  state.counters["shade_ms"] = per_frame_ms(times.shade_s);
  state.counters["label_ms"] = per_frame_ms(times.label_s);
}
BENCHMARK(frame_with_truth)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();

void sensor_noise(benchmark::State& state) {
  const Stage& s = stage();
  CleanFrame frame = s.renderer.render(s.pose, nullptr);
  const SensorModel sensor(s.camera.sensor, {});
  const Exposure exposure = sensor.expose(frame.radiance);
  int index = 0;
  for (auto _ : state)
    benchmark::DoNotOptimize(sensor.digitise(frame.radiance, exposure, index++, frame.truth.masks));
}
BENCHMARK(sensor_noise)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();

void exposure(benchmark::State& state) {
  const Stage& s = stage();
  const CleanFrame frame = s.renderer.render(s.pose, nullptr);
  const SensorModel sensor(s.camera.sensor, {});
  for (auto _ : state) benchmark::DoNotOptimize(sensor.expose(frame.radiance));
}
BENCHMARK(exposure)->Unit(benchmark::kMillisecond);

}  // namespace
