#pragma once
// Who looks on while a reconstruction works.

#include <cstddef>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <string>

namespace rugae {

/// Called from the thread that calls the reconstruction, which waits meanwhile.
class Listener {
 public:
  virtual ~Listener() = default;
  /// `done` of `total` steps of a stage (0: not known).
  virtual void progress(const std::string& /*stage*/, std::size_t /*done*/, std::size_t /*total*/) {
  }
  /// A stage's intermediate, 8-bit; the name is that of its file below pictures/ of an estimate,
  /// "tracks/000012.png", or "followed/000012.png" for each key frame while frames come: what was
  /// followed into it, blue for new points, red for old.
  virtual void picture(const std::string& /*name*/, const cv::Mat& /*image*/) {}
};

using PictureSink = std::function<void(const std::string& name, const cv::Mat& image)>;

}  // namespace rugae
