#include "render/frame_loop.h"

#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <future>
#include <optional>

#include "render/thread_clock.h"

namespace rugae {
namespace {

PoseTrack row_track(const RowPoses& rows, double time_s) {
  PoseTrack track;
  for (std::size_t k = 0; rows.rolling() && k < rows.poses().size(); ++k)
    track.push_back({time_s + rows.offset_s(static_cast<double>(k) - 0.5), rows.poses()[k]});
  return track;
}

}  // namespace

void FrameLoop::run(const std::vector<int>& frames, int threads, Progress& progress,
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

// Exposure goes through the frames in order: it may follow those before.
void FrameLoop::pipeline(const std::vector<int>& frames, std::size_t in_flight) {
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
  const auto written = tbb::make_filter<ShotPtr, void>(filter_mode::parallel,
                                                       [&](const ShotPtr& shot) { finish(*shot); });
  tbb::parallel_pipeline(in_flight, first & rendered & exposed & written);
}

// What the sharp frame was metered for, gathered over pixel, aperture and exposure.
cv::Mat FrameLoop::gather(int frame, double exposure_s, std::span<const PixelMaterial> materials) {
  LensSampling sampling = stages_.sampling;
  sampling.frame = static_cast<std::uint32_t>(frame);
  sampling.exposure_s = stages_.blurs ? exposure_s : 0.0;
  return stages_.renderer.gather(stages_.motion.view(frame), sampling, &times, materials);
}

FrameLoop::ShotPtr FrameLoop::shoot(int frame) {
  const FrameView now = stages_.motion.view(frame);
  std::optional<FrameView> previous, next;
  if (frame > 0 && stages_.renderer.needs_previous()) previous = stages_.motion.view(frame - 1);
  if (frame + 1 < static_cast<int>(stages_.track.size()) && stages_.renderer.needs_next())
    next = stages_.motion.view(frame + 1);
  CleanFrame clean = stages_.renderer.render(now, previous ? &*previous : nullptr,
                                             next ? &*next : nullptr, &times);
  clean.truth.row_poses =
      row_track(now.camera, stages_.track[static_cast<std::size_t>(frame)].time_s);
  clean.truth.wall_displacement_mm = stages_.motion.displacement_mm(frame);
  if (!track_points.empty())
    clean.truth.tracks = follow_tracks(stages_.renderer, now, track_points);
  const double start = thread_seconds();
  const Exposure metered = stages_.sensor.expose(clean.radiance);
  sensor_s += thread_seconds() - start;
  return std::make_shared<Shot>(Shot{frame, std::move(clean), {{}, metered}});
}

void FrameLoop::expose(Shot& shot) {
  const std::lock_guard lock(mutex_);
  const auto known = exposures_->find(shot.frame);
  shot.exposure.used = known != exposures_->end()
                           ? known->second.used
                           : stages_.control.next(shot.frame, shot.exposure.metered, *exposures_);
  (*exposures_)[shot.frame] = shot.exposure;
}

void FrameLoop::finish(Shot& shot) {
  if (shot.frame >= stages_.first_written) write(shot);
  const std::lock_guard lock(mutex_);
  ++rendered_;
  changed_.notify_one();
}

void FrameLoop::write(Shot& shot) {
  FrameTruth& truth = shot.clean.truth;
  const Exposure& exposure = shot.exposure.used;
  const cv::Mat& sharp = shot.clean.radiance;
  const cv::Mat radiance = stages_.sampling.samples > 1
                               ? gather(shot.frame, exposure.time_s, shot.clean.materials)
                               : sharp;
  const SensorImages images = stages_.sensor.digitise(radiance, exposure, shot.frame, truth.masks,
                                                      stages_.output.adc, &sensor_s);
  for (cv::Mat* part : {&truth.diffuse, &truth.specular, &truth.indirect})
    if (!part->empty()) stages_.sensor.make_relative(*part, exposure);
  ExtraImages extra{images.adc_bgr, images.mosaic, {}, {}};
  if (stages_.output.radiance) extra.radiance = stages_.sensor.relative(radiance, exposure);
  if (stages_.output.paired) {
    cv::Mat unused(radiance.size(), CV_8U, cv::Scalar(0));
    extra.clean =
        stages_.clean_sensor.digitise(sharp, exposure, shot.frame, unused, false, &sensor_s).bgr;
  }
  {
    const std::lock_guard lock(mutex_);
    stages_.log.add(shot.frame, shot.exposure);
  }
  const ThreadUsage before = thread_usage();
  stages_.writer.write_frame(shot.frame, images.bgr, truth, extra);
  const ThreadUsage after = thread_usage();
  encode_s += after.user_s - before.user_s;
  write_s += after.system_s - before.system_s;
}

}  // namespace rugae
