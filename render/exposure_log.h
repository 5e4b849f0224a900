#pragma once
// The exposures of the frames written so far, kept beside them so that a killed run goes on without
// rendering again. Complete datasets hold them in frames.csv.

#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>

#include "render/metering.h"

namespace rugae {

class ExposureLog {
 public:
  /// What is known of the dataset in `root`: from its frames.csv (all exposures; no metering is
  /// needed then), or from the log of an unfinished run (a half-written last line is ignored).
  static std::map<int, FrameExposure> read(const std::filesystem::path& root);

  /// Starts the log anew with what is known. It has the name of a temporary file: finishing a
  /// dataset removes it. A finished one, which has all exposures, gets none.
  ExposureLog(const std::filesystem::path& root, const std::map<int, FrameExposure>& known);
  /// Add a frame before its image is published, so that no frame is without its exposure. One
  /// thread at a time.
  void add(int frame, const FrameExposure& exposure);

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::filesystem::path path_;
  std::unique_ptr<std::FILE, Close> file_;
};

}  // namespace rugae
