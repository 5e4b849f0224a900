#pragma once
// The reconstruction as an object that takes frames one at a time.

#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "core/progress.h"
#include "dataset/estimate.h"
#include "dataset/observations.h"
#include "recon/frame_follower.h"
#include "recon/listener.h"
#include "recon/live_path.h"
#include "recon/options.h"
#include "recon/preprocess/preprocess.h"

namespace rugae {

/// Key frames are chosen and followed as frames come; what is known by then of path and wall can be
/// asked for at any time, and costs its time then. finish() makes the estimate of all frames: who
/// asks in between does not change it.
class Reconstruction {
 public:
  /// Of frames that are there already; add() goes on to the next.
  Reconstruction(const Observations& recorded, const ReconOptions& options);
  /// Of frames that come from elsewhere. They are kept in `folder`, which becomes an observations
  /// folder (Observations::record). De-vignetting, which takes frames from all of the sequence,
  /// waits for finish().
  Reconstruction(const std::filesystem::path& folder, const Calibration& calibration,
                 const ReconOptions& options);
  ~Reconstruction();

  /// From now on; it must outlive this, or nullptr follows.
  void listen(Listener* listener) { listener_ = listener; }

  /// The next recorded frame. Throws Error when there is none.
  void add();
  /// A frame of the lens' size, CV_8UC3 in BGR; times ascend.
  void add(const cv::Mat& bgr, double time_s);
  /// How many were added.
  int size() const { return added_; }

  /// world_from_camera of the latest frame, in the world and unit of structure(). Empty while the
  /// camera has not moved enough to tell, and where the frame is lost.
  std::optional<Rigid3> pose();
  /// Key frames and sparse points so far; not adjusted to the end, without revisits.
  const Structure& structure();
  /// The wall so far, in the same world; empty where no key frame is placed.
  TriangleMesh map();

  /// The estimate of the frames added, and its folder, as reconstruct() leaves it. Nothing can be
  /// added afterwards. Throws Error for fewer than two usable frames, and where recorded frames are
  /// left.
  Estimate finish(const std::filesystem::path& out, Progress& progress);

 private:
  void begin();
  void check_open() const;
  void catch_up();
  void show_what_was_followed();
  LivePath& live();

  ReconOptions options_;
  bool recorded_;
  std::unique_ptr<FrameSource> frames_;
  std::unique_ptr<FrameFollower> follower_;
  std::unique_ptr<LivePath> live_;  // from the first question on
  Listener* listener_ = nullptr;
  std::size_t shown_ = 0;  // key frames handed to the listener
  int added_ = 0;          // frames
  StageTime preprocessing_{"preprocessing"};
};

}  // namespace rugae
