#include "render/simulate.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>

#include "core/check.h"
#include "core/files.h"
#include "core/presets.h"
#include "core/units.h"
#include "dataset/writer.h"
#include "render/clearance.h"
#include "render/frame_loop.h"
#include "render/scene_truth.h"
#include "render/sensor.h"
#include "render/tracks.h"
#include "scenes/chessboard.h"
#include "trajectories/trajectory.h"

namespace rugae {
namespace {

constexpr double kLightClearance_mm = 1.0;  // assumed: of a light that stands out of the housing

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

struct Path {
  PoseTrack track;
  CameraPath between;  // the frames too
  double length_mm = 0.0, min_clearance_mm = 0.0;
  int first_of = 0;  // the track is the first part of so many frames; 0: all of them
};

Path first_part(Path path, int first) {
  if (first <= 0 || first >= static_cast<int>(path.track.size())) return path;
  path.first_of = static_cast<int>(path.track.size());
  path.track.resize(static_cast<std::size_t>(first));
  path.length_mm = length_mm(path.track);
  return path;
}

// As many frames as the paper has for this camera and trajectory, or as the track in a file has
// poses, or as a stop-motion has views; a path that is none of these is taken for as long as the
// paper's first.
int default_frames(const TrajectoryOptions& trajectory, const Camera& camera) {
  if (trajectory.board.count > 0) return trajectory.board.count;
  if (!trajectory.file.empty()) return static_cast<int>(read_tum(trajectory.file).size());
  const int frames = frames_of_trajectory(camera, std::max(1, trajectory.paper_number));
  check(
      frames >= 2,
      "camera '{}' has frames_in_paper: {}, which leaves {} for this trajectory, expected at least "
      "2; give their number (--frames)",
      camera.name, camera.frames_in_paper, frames);
  return frames;
}

// Scene and trajectory both of a board, or neither.
void check_board(const SimulateOptions& options, const TrajectoryOptions& trajectory,
                 const Scene& scene) {
  const bool looks_at_board = trajectory.board.count > 0;
  check(!looks_at_board || scene.board,
        "trajectory '{}' looks at a chessboard, but scene '{}' is none; try the scene 'chessboard'",
        trajectory.name, options.scene);
  check(!scene.board || looks_at_board,
        "scene '{}' is a flat chessboard, in which no path can be planned; try the trajectory "
        "'chessboard'",
        options.scene);
}

// A stop-motion: the camera rests while a frame is taken.
Path find_board_views(const TrajectoryOptions& trajectory, int frames, const Camera& camera,
                      const Scene& scene, std::uint64_t seed) {
  const Eigen::AlignedBox2d extent = scene.board->extent_mm();
  const BoardOutline outline{.first_mm = {extent.min().x(), extent.min().y(), 0.0},
                             .across_mm = {extent.sizes().x(), 0.0, 0.0},
                             .down_mm = {0.0, extent.sizes().y(), 0.0}};
  PoseTrack track =
      plan_board_views(camera.lens, outline, trajectory.board, trajectory.clearance_mm, frames,
                       camera.sensor.fps, seed, trajectory.name);
  const ClosestPoint closest(scene.wall);
  Path path{track, [track](double frame) { return held_pose(track, frame); }, length_mm(track),
            std::numeric_limits<double>::infinity()};
  for (const TimedPose& pose : track)
    path.min_clearance_mm =
        std::min(path.min_clearance_mm, closest(pose.world_from_camera.translation).distance_mm);
  return path;
}

Path find_path(const SimulateOptions& options, const TrajectoryOptions& trajectory,
               const Mount& mount, const Scene& scene) {
  const Camera& camera = mount.camera;
  const int frames = options.frames > 0 ? options.frames : default_frames(trajectory, camera);
  check_board(options, trajectory, scene);
  if (scene.board)
    return first_part(find_board_views(trajectory, frames, camera, scene, options.seed),
                      options.first);
  // a planned path keeps clear of wherever the wall may move; a given one is only checked
  TrajectoryOptions at_rest = trajectory;
  double clearance_mm =
      std::max(trajectory.clearance_mm, 0.5 * std::max(camera.diameter_mm, mount.diameter_mm)) +
      mount.reach_mm;
  // A light in the wall would leave everything dark. A rig's reach has the lights in it.
  if (mount.reach_mm == 0.0)
    for (const Emitter& light : camera.lights)
      clearance_mm = std::max(clearance_mm, light.offset_mm.norm() + kLightClearance_mm);
  at_rest.clearance_mm = clearance_mm;
  if (trajectory.file.empty()) at_rest.clearance_mm += scene.motion_reach_mm;
  const PlannedPath path = plan_path(scene.wall, at_rest, options.seed);
  PoseTrack track = sample_path(path, frames, camera.sensor.fps);
  check_moving_clearance(scene, track, clearance_mm,
                         fmt::format("trajectory '{}'", trajectory.name));
  // A camera in the capsule's place keeps the path to the last bit.
  const Rigid3 capsule_from_camera = mount.capsule_from_camera;
  const bool beside = !capsule_from_camera.translation.isZero(0.0) ||
                      !capsule_from_camera.rotation.vec().isZero(0.0);
  const auto mounted = [capsule_from_camera, beside](const Rigid3& capsule) {
    return beside ? capsule * capsule_from_camera : capsule;
  };
  for (TimedPose& pose : track) pose.world_from_camera = mounted(pose.world_from_camera);
  const double last = frames - 1.0;
  return first_part(
      {std::move(track),
       [path, last, mounted](double frame) { return mounted(sampled_pose(path, frame / last)); },
       path.length_mm(), path.min_clearance_mm()},
      options.first);
}

// Where nothing moves while a frame is taken, all rows see the same.
double row_time_s(const RenderSettings& render, const Camera& camera, const Scene& scene) {
  const bool rolling =
      render.lens.rolling_shutter && !scene.board && camera.sensor.shutter == Shutter::rolling;
  return rolling ? 1e-6 * camera.sensor.row_time_us : 0.0;
}

LensSampling lens_sampling(const LensSettings& lens, const Camera& camera, std::uint64_t seed) {
  LensSampling sampling{.samples = lens.samples, .seed = seed};
  if (lens.defocus) {
    sampling.aperture_radius_mm = aperture_radius_mm(camera);
    sampling.focus_distance_mm = camera.focus.distance_mm;
  }
  return sampling;
}

// What a trajectory's file says of the noise, which a file may say otherwise tomorrow; 1 of a
// preset.
double own_noise_factor(const SimulateOptions& options, const TrajectoryOptions& trajectory) {
  const bool preset = std::ranges::count(preset_names("trajectories"), options.trajectory) > 0;
  return preset ? 1.0 : trajectory.read_noise_factor;
}

DatasetInfo info_of(const SimulateOptions& options, const Path& path, const Camera& camera,
                    const Scene& scene, double noise_factor) {
  DatasetInfo info;
  info.scene = options.scene;
  info.camera = options.camera;
  info.trajectory = options.trajectory;
  info.resolution = options.resolution;
  info.seed = options.seed;
  info.frames = static_cast<int>(path.track.size());
  const OutputSettings& output = options.render.output;
  info.images = {output.frames == FrameFormat::jpeg,
                 output.jpeg_quality,
                 output.adc,
                 output.mosaic,
                 output.radiance,
                 output.paired};
  const TruthSettings& truth = options.render.truth;
  const bool labels = options.render.labels;
  info.truth = {options.render.wanted_labels(), row_time_s(options.render, camera, scene) > 0.0,
                static_cast<bool>(scene.motion), labels && truth.tracks > 0,
                labels && truth.coverage};
  info.text = with_scene(settings_json(options.render), scene, path.first_of, noise_factor);
  return info;
}

}  // namespace

void SimulateOptions::check() const {
  render.check();
  rugae::check(frames == 0 || frames >= 2, "frames is {}, expected at least 2", frames);
  rugae::check(first == 0 || first >= 2, "first is {}, expected at least 2", first);
  rugae::check(only_frame >= -1, "only-frame is {}, expected at least 0", only_frame);
  rugae::check(threads >= 0, "threads is {}, expected at least 0", threads);
  rugae::check(frames == 0 || only_frame < frames, "only-frame is {}, but there are {} frames",
               only_frame, frames);
}

SimulateResult simulate(const SimulateOptions& options, const std::filesystem::path& out,
                        Progress& progress) {
  options.check();
  if (is_rig(options.camera)) {
    check(load_trajectory(options.trajectory).board.count == 0,
          "trajectory '{}' is planned for one camera; simulate the cameras of rig '{}' one by one",
          options.trajectory, options.camera);
    return simulate_rig(options, load_rig(options.camera), out, progress);
  }
  return simulate_mounted(options, {load_camera(options.camera), {}, 0.0, 0.0, options.seed}, out,
                          progress);
}

SimulateResult simulate_mounted(const SimulateOptions& options, const Mount& mount,
                                const std::filesystem::path& out, Progress& progress) {
  options.check();
  const int threads =
      options.threads > 0 ? options.threads : tbb::this_task_arena::max_concurrency();

  progress.begin("scene");
  const Camera& camera = mount.camera;
  check(!options.render.lens.defocus || camera.focus.f_number > 0.0,
        "camera '{}' has no focus (f_number and distance_mm), which lens.defocus needs",
        camera.name);
  check(!options.render.sensor.prnu || camera.sensor.prnu > 0.0,
        "camera '{}' has no prnu, which sensor.prnu needs", camera.name);
  check(!options.render.sensor.dsnu || camera.sensor.dsnu_e > 0.0,
        "camera '{}' has no dsnu_e, which sensor.dsnu needs", camera.name);
  const TrajectoryOptions trajectory = load_trajectory(options.trajectory);
  make_folder(out);  // a folder that cannot be is said before the long work, not after
  const Scene scene = load_scene({options.scene, options.seed, options.resolution, trajectory.oil});
  progress.end(fmt::format("{} triangles", scene.wall.triangles.size()));

  progress.begin("path");
  const Path path = find_path(options, trajectory, mount, scene);
  const int frames = static_cast<int>(path.track.size());
  check(options.only_frame < frames, "only-frame is {}, but there are {} frames",
        options.only_frame, frames);
  progress.end(fmt::format("{:.1f} cm", cm_from_mm(path.length_mm)));

  const bool whole = options.only_frame < 0;
  std::map<int, FrameExposure> exposures = ExposureLog::read(out);
  DatasetWriter writer(
      out, info_of(options, path, camera, scene, own_noise_factor(options, trajectory)));
  if (whole) writer.check_finished();
  writer.write_scene(camera, path.track, scene.wall);
  write_scene_truth(scene, writer.layout().truth());
  const ExposureControl control(camera.sensor, options.render.sensor);
  const int first = std::max(0, options.only_frame), last = whole ? frames - 1 : first;
  std::vector<int> todo;
  for (int i = first; i <= last; ++i)
    if (!whole || !(writer.has_frame(i) && exposures.contains(i))) todo.push_back(i);
  // a single frame whose exposure follows others
  std::vector<int> metered;
  if (control.has_memory() && !whole && !exposures.contains(first))
    for (int i = 0; i < first; ++i) metered.push_back(i);

  SimulateResult result;
  result.frames = static_cast<int>(todo.size());
  result.skipped = whole ? frames - result.frames : 0;
  result.path_length_mm = path.length_mm;
  result.min_clearance_mm = path.min_clearance_mm;

  progress.begin("frames", metered.size() + todo.size());
  const bool tracks = options.render.labels && options.render.truth.tracks > 0;
  if (!todo.empty() || (tracks && !std::filesystem::exists(writer.layout().track_points()))) {
    const LightSettings& light = options.render.light;
    const TruthSettings& truth = options.render.truth;
    const FrameRenderer renderer(
        scene, camera,
        {.vignetting = options.render.lens.vignetting,
         .labels = options.render.wanted_labels(),
         .paths = {light.bounces, light.samples, light.roulette, mount.noise_seed},
         // A pixel's material stands for all of its footprint, but not for what lies beyond an edge
         // of print.
         .keep_materials = options.render.lens.samples > 1 && !scene.board,
         .device = options.ray_device,
         .highlights = light.highlights});
    const SceneMotion motion(renderer.wall(), scene.motion, path.between,
                             {.frames = frames,
                              .fps = camera.sensor.fps,
                              .height = camera.lens.height,
                              .row_time_s = row_time_s(options.render, camera, scene),
                              .moves_within = options.render.lens.motion_blur,
                              .in_flight = 2 * threads});
    const SensorOptions sensing{.chain = options.render.sensor,
                                .read_noise_factor = trajectory.read_noise_factor,
                                .seed = mount.noise_seed,
                                .blanked = blanked_by_stop(camera.lens)};
    const SensorModel sensor(camera.sensor, sensing),
        clean_sensor(camera.sensor, faultless(sensing));
    ExposureLog log(out, exposures);
    todo.insert(todo.begin(), metered.begin(), metered.end());
    FrameLoop loop({.renderer = renderer,
                    .motion = motion,
                    .sensor = sensor,
                    .clean_sensor = clean_sensor,
                    .control = control,
                    .output = options.render.output,
                    .writer = writer,
                    .log = log,
                    .track = path.track,
                    .sampling = lens_sampling(options.render.lens, camera, mount.noise_seed),
                    .blurs = options.render.lens.motion_blur,
                    .first_written = first});
    if (tracks) {
      loop.track_points = choose_track_points(renderer, motion, frames, truth.tracks, options.seed);
      writer.write_track_points(loop.track_points);
    }
    const Clock::time_point loop_start = Clock::now();
    loop.run(todo, threads, progress, exposures);
    result.wall_s = seconds_since(loop_start);
    result.trace_s = loop.times.trace_s;
    result.shade_s = loop.times.shade_s;
    result.label_s = loop.times.label_s;
    result.sensor_s = loop.sensor_s;
    result.encode_s = loop.encode_s;
    result.write_s = loop.write_s;
  }
  progress.end(result.skipped > 0 ? fmt::format("{} found finished", result.skipped) : "");

  if (whole) {
    progress.begin("manifest");
    std::vector<double> exposure_s, gain;
    for (int i = 0; i < frames; ++i) {
      exposure_s.push_back(exposures.at(i).used.time_s);
      gain.push_back(exposures.at(i).used.gain);
    }
    writer.finish(exposure_s, gain);
    progress.end();
  }
  return result;
}

}  // namespace rugae
