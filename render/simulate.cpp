#include "render/simulate.h"

#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <condition_variable>
#include <future>
#include <memory>
#include <mutex>
#include <optional>

#include "core/check.h"
#include "core/files.h"
#include "core/units.h"
#include "dataset/writer.h"
#include "render/clearance.h"
#include "render/exposure_log.h"
#include "render/frame.h"
#include "render/scene_truth.h"
#include "render/sensor.h"
#include "render/thread_clock.h"
#include "render/tracks.h"
#include "trajectories/trajectory.h"

namespace rugae {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

struct Path {
  PoseTrack track;
  CameraPath between;  // the frames too
  double length_mm = 0.0, min_clearance_mm = 0.0;
};

// As many frames as the paper has for this camera and trajectory, or as the track in a file has
// poses; a path that is neither is taken for as long as the paper's first.
int default_frames(const TrajectoryOptions& trajectory, const Camera& camera) {
  if (!trajectory.file.empty()) return static_cast<int>(read_tum(trajectory.file).size());
  return frames_of_trajectory(camera, std::max(1, trajectory.paper_number));
}

Path find_path(const SimulateOptions& options, const TrajectoryOptions& trajectory,
               const Mount& mount, const Scene& scene) {
  const Camera& camera = mount.camera;
  const int frames = options.frames > 0 ? options.frames : default_frames(trajectory, camera);
  // a planned path keeps clear of wherever the wall may move; a given one is only checked
  TrajectoryOptions at_rest = trajectory;
  at_rest.clearance_mm += mount.reach_mm;
  if (trajectory.file.empty()) at_rest.clearance_mm += scene.motion_reach_mm;
  const PlannedPath path = plan_path(scene.wall, at_rest, options.seed);
  PoseTrack track = sample_path(path, frames, camera.sensor.fps);
  check_moving_clearance(scene, track, trajectory.clearance_mm + mount.reach_mm,
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
  return {std::move(track),
          [path, last, mounted](double frame) { return mounted(sampled_pose(path, frame / last)); },
          path.length_mm(), path.min_clearance_mm()};
}

double row_time_s(const RenderSettings& render, const Camera& camera) {
  const bool rolling = render.lens.rolling_shutter && camera.sensor.shutter == Shutter::rolling;
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

DatasetInfo info_of(const SimulateOptions& options, int frames, const Camera& camera,
                    const Scene& scene) {
  DatasetInfo info;
  info.scene = options.scene;
  info.camera = options.camera;
  info.trajectory = options.trajectory;
  info.resolution = options.resolution;
  info.seed = options.seed;
  info.frames = frames;
  const OutputSettings& output = options.render.output;
  info.images = {output.frames == FrameFormat::jpeg,
                 output.jpeg_quality,
                 output.adc,
                 output.mosaic,
                 output.radiance,
                 output.paired};
  const TruthSettings& truth = options.render.truth;
  const bool labels = options.render.labels;
  info.truth = {options.render.wanted_labels(), row_time_s(options.render, camera) > 0.0,
                static_cast<bool>(scene.motion), labels && truth.tracks > 0,
                labels && truth.coverage};
  info.text = with_scene(settings_json(options.render), scene);
  return info;
}

PoseTrack row_track(const RowPoses& rows, double time_s) {
  PoseTrack track;
  for (std::size_t k = 0; rows.rolling() && k < rows.poses().size(); ++k)
    track.push_back({time_s + rows.offset_s(static_cast<double>(k) - 0.5), rows.poses()[k]});
  return track;
}

// Frames go through a pipeline in the arena's threads; the thread that called waits, counts the
// finished ones, and passes on the wish to stop. Whole frames run side by side, and their tiles too
// where threads would idle, so few frames use all threads as well.
class FrameLoop {
 public:
  // Frames before `first_written` are rendered for their metering alone.
  FrameLoop(const FrameRenderer& renderer, const Motion& motion, const SensorModel& sensor,
            const SensorModel& clean_sensor, const ExposureControl& control,
            const OutputSettings& output, const DatasetWriter& writer, const PoseTrack& track,
            int first_written, const LensSampling& sampling, bool blurs, ExposureLog* log)
      : renderer_(renderer),
        motion_(motion),
        sensor_(sensor),
        clean_sensor_(clean_sensor),
        control_(control),
        output_(output),
        writer_(writer),
        track_(track),
        first_written_(first_written),
        sampling_(sampling),
        blurs_(blurs),
        log_(log) {}

  void run(const std::vector<int>& frames, int threads, Progress& progress,
           std::map<int, FrameExposure>& exposures) {
    exposures_ = &exposures;
    auto done = std::async(std::launch::async, [&] {
      const struct Finished {  // also when an exception leaves the pipeline
        FrameLoop& loop;
        ~Finished() {
          const std::lock_guard lock(loop.mutex_);
          loop.finished_ = true;
          loop.changed_.notify_one();
        }
      } finished{*this};
      tbb::task_arena arena(threads);
      arena.execute([&] { pipeline(frames, 2 * static_cast<std::size_t>(threads)); });
    });
    try {
      std::size_t reported = 0;
      std::unique_lock lock(mutex_);
      while (!finished_ || reported < rendered_) {
        changed_.wait(lock, [&] { return finished_ || rendered_ > reported; });
        const std::size_t now = rendered_;
        lock.unlock();
        if (now > reported) progress.step(now - reported);
        reported = now;
        lock.lock();
        if (finished_) break;
      }
    } catch (...) {
      stop_ = true;
      done.wait();
      throw;
    }
    done.get();
  }

  RenderTimes times;
  std::vector<TrackPoint> track_points;  // to be followed
  std::atomic<double> sensor_s = 0.0, encode_s = 0.0, write_s = 0.0;

 private:
  // A frame between its rendering and its file.
  struct Shot {
    int frame = 0;
    CleanFrame clean;
    FrameExposure exposure;
  };
  using ShotPtr = std::shared_ptr<Shot>;

  // Exposure goes through the frames in order: it may follow those before.
  void pipeline(const std::vector<int>& frames, std::size_t in_flight) {
    using tbb::filter_mode;
    std::size_t next = 0;
    const auto first =
        tbb::make_filter<void, int>(filter_mode::serial_in_order, [&](tbb::flow_control& control) {
          if (next == frames.size() || stop_) {
            control.stop();
            return -1;
          }
          return frames[next++];
        });
    const auto rendered = tbb::make_filter<int, ShotPtr>(filter_mode::parallel,
                                                         [&](int frame) { return shoot(frame); });
    const auto exposed =
        tbb::make_filter<ShotPtr, ShotPtr>(filter_mode::serial_in_order, [&](const ShotPtr& shot) {
          expose(*shot);
          return shot;
        });
    const auto written = tbb::make_filter<ShotPtr, void>(
        filter_mode::parallel, [&](const ShotPtr& shot) { finish(*shot); });
    tbb::parallel_pipeline(in_flight, first & rendered & exposed & written);
  }

  // What the sharp frame was metered for, gathered over pixel, aperture and exposure.
  cv::Mat gather(int frame, double exposure_s, std::span<const PixelMaterial> materials) {
    LensSampling sampling = sampling_;
    sampling.frame = static_cast<std::uint32_t>(frame);
    sampling.exposure_s = blurs_ ? exposure_s : 0.0;
    return renderer_.gather(motion_.view(frame), sampling, &times, materials);
  }

  ShotPtr shoot(int frame) {
    const FrameView now = motion_.view(frame);
    std::optional<FrameView> previous, next;
    if (frame > 0 && renderer_.needs_previous()) previous = motion_.view(frame - 1);
    if (frame + 1 < static_cast<int>(track_.size()) && renderer_.needs_next())
      next = motion_.view(frame + 1);
    CleanFrame clean =
        renderer_.render(now, previous ? &*previous : nullptr, next ? &*next : nullptr, &times);
    clean.truth.row_poses = row_track(now.camera, track_[static_cast<std::size_t>(frame)].time_s);
    clean.truth.wall_displacement_mm = motion_.displacement_mm(frame);
    if (!track_points.empty()) clean.truth.tracks = follow_tracks(renderer_, now, track_points);
    const double start = thread_seconds();
    const Exposure metered = sensor_.expose(clean.radiance);
    sensor_s += thread_seconds() - start;
    return std::make_shared<Shot>(Shot{frame, std::move(clean), {{}, metered}});
  }

  void expose(Shot& shot) {
    const std::lock_guard lock(mutex_);
    const auto known = exposures_->find(shot.frame);
    shot.exposure.used = known != exposures_->end()
                             ? known->second.used
                             : control_.next(shot.frame, shot.exposure.metered, *exposures_);
    (*exposures_)[shot.frame] = shot.exposure;
  }

  void finish(Shot& shot) {
    if (shot.frame >= first_written_) write(shot);
    const std::lock_guard lock(mutex_);
    ++rendered_;
    changed_.notify_one();
  }

  void write(Shot& shot) {
    FrameTruth& truth = shot.clean.truth;
    const Exposure& exposure = shot.exposure.used;
    const cv::Mat& sharp = shot.clean.radiance;
    const cv::Mat radiance =
        sampling_.samples > 1 ? gather(shot.frame, exposure.time_s, shot.clean.materials) : sharp;
    const SensorImages images =
        sensor_.digitise(radiance, exposure, shot.frame, truth.masks, output_.adc, &sensor_s);
    for (cv::Mat* part : {&truth.diffuse, &truth.specular, &truth.indirect})
      if (!part->empty()) *part = sensor_.relative(*part, exposure);
    ExtraImages extra{images.adc_bgr, images.mosaic, {}, {}};
    if (output_.radiance) extra.radiance = sensor_.relative(radiance, exposure);
    if (output_.paired) {
      cv::Mat unused(radiance.size(), CV_8U, cv::Scalar(0));
      extra.clean =
          clean_sensor_.digitise(sharp, exposure, shot.frame, unused, false, &sensor_s).bgr;
    }
    {
      const std::lock_guard lock(mutex_);
      if (log_) log_->add(shot.frame, shot.exposure);
    }
    const ThreadUsage before = thread_usage();
    writer_.write_frame(shot.frame, images.bgr, truth, extra);
    const ThreadUsage after = thread_usage();
    encode_s += after.user_s - before.user_s;
    write_s += after.system_s - before.system_s;
  }

  const FrameRenderer& renderer_;
  const Motion& motion_;
  const SensorModel &sensor_, &clean_sensor_;
  const ExposureControl& control_;
  const OutputSettings& output_;
  const DatasetWriter& writer_;
  const PoseTrack& track_;
  int first_written_;
  LensSampling sampling_;
  bool blurs_;  // over the exposure
  ExposureLog* log_;
  std::map<int, FrameExposure>* exposures_ = nullptr;
  std::atomic<bool> stop_ = false;
  std::mutex mutex_;  // of what follows, the log and the exposures
  std::condition_variable changed_;
  std::size_t rendered_ = 0;
  bool finished_ = false;
};

}  // namespace

void SimulateOptions::check() const {
  render.check();
  rugae::check(frames == 0 || frames >= 2, "frames is {}, expected at least 2", frames);
  rugae::check(only_frame >= -1, "only-frame is {}, expected at least 0", only_frame);
  rugae::check(threads >= 0, "threads is {}, expected at least 0", threads);
  rugae::check(frames == 0 || only_frame < frames, "only-frame is {}, but there are {} frames",
               only_frame, frames);
}

SimulateResult simulate(const SimulateOptions& options, const std::filesystem::path& out,
                        Progress& progress) {
  options.check();
  if (is_rig(options.camera)) return simulate_rig(options, load_rig(options.camera), out, progress);
  return simulate_mounted(options, {load_camera(options.camera), {}, 0.0, options.seed}, out,
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
  DatasetWriter writer(out, info_of(options, frames, camera, scene));
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
  if (!todo.empty()) {
    const LightSettings& light = options.render.light;
    const TruthSettings& truth = options.render.truth;
    const FrameRenderer renderer(
        scene, camera,
        {.vignetting = options.render.lens.vignetting,
         .labels = options.render.wanted_labels(),
         .paths = {light.bounces, light.samples, light.roulette, mount.noise_seed},
         .keep_materials = options.render.lens.samples > 1,
         .device = options.ray_device});
    const Motion motion(renderer.wall(), scene.motion, path.between,
                        {.frames = frames,
                         .fps = camera.sensor.fps,
                         .height = camera.lens.height,
                         .row_time_s = row_time_s(options.render, camera),
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
    FrameLoop loop(renderer, motion, sensor, clean_sensor, control, options.render.output, writer,
                   path.track, first, lens_sampling(options.render.lens, camera, mount.noise_seed),
                   options.render.lens.motion_blur, &log);
    if (options.render.labels && truth.tracks > 0) {
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
