#pragma once
// The frames of a sequence, from their rendering to their files, by all threads.

#include <atomic>
#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "core/pose_track.h"
#include "core/progress.h"
#include "dataset/writer.h"
#include "render/exposure_log.h"
#include "render/frame.h"
#include "render/sensor.h"
#include "render/tracks.h"

namespace rugae {

/// Frames go through a pipeline in the arena's threads; the thread that called waits, counts the
/// finished ones, and passes on the wish to stop. Whole frames run side by side, and their tiles
/// too where threads would idle, so few frames use all threads as well.
class FrameLoop {
 public:
  /// What a frame passes on its way. All of it must outlive the loop.
  struct Stages {
    const FrameRenderer& renderer;
    const SceneMotion& motion;
    const SensorModel &sensor, &clean_sensor;
    const ExposureControl& control;
    const OutputSettings& output;
    const DatasetWriter& writer;
    ExposureLog& log;
    const PoseTrack& track;
    LensSampling sampling;
    bool blurs = false;     // over the exposure
    int first_written = 0;  // frames before it are rendered for their metering alone
  };
  explicit FrameLoop(const Stages& stages) : stages_(stages) {}

  /// Renders and writes the frames, and adds their exposures to those known.
  void run(const std::vector<int>& frames, int threads, Progress& progress,
           std::map<int, FrameExposure>& exposures);

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

  void pipeline(const std::vector<int>& frames, std::size_t in_flight);
  cv::Mat gather(int frame, double exposure_s, std::span<const PixelMaterial> materials);
  ShotPtr shoot(int frame);
  void expose(Shot& shot);
  void finish(Shot& shot);
  void write(Shot& shot);

  const Stages stages_;
  std::map<int, FrameExposure>* exposures_ = nullptr;
  std::atomic<bool> stop_ = false;
  std::mutex mutex_;  // of what follows, the log and the exposures
  std::condition_variable changed_;
  std::size_t rendered_ = 0;
  bool finished_ = false;
};

}  // namespace rugae
