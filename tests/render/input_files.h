#pragma once
// Input files that are drawn, written, read and rendered.

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/files.h"
#include "core/presets.h"
#include "render/frame.h"
#include "tests/properties.h"

namespace rugae::test {

namespace fs = std::filesystem;

// A file that is written anew for every case.
class InputFiles : public testing::Test {
 protected:
  void SetUp() override { make_folder(root_); }
  void TearDown() override { fs::remove_all(root_); }
  std::string file(const std::string& text, const char* name = "given.yaml") const {
    const fs::path path = root_ / name;
    write_atomic(path, text);
    return path.string();
  }
  // Every text with one mistake is refused, and junk does no harm.
  void expect_mistakes_refused(const std::function<std::string()>& sound,
                               const std::function<void(const std::string&)>& read) const {
    for_cases(300, [&] {
      const std::string text = Breaker(sound()).broken();
      std::string message;
      const std::string given = file(text);
      const bool refused = refuses([&] { read(given); }, "given.yaml", message);
      RC_LOG(text);
      RC_LOG(message);
      RC_ASSERT(refused);
    });
    for_cases(300, [&] {
      const std::string text = junk(sound());
      std::string message;
      const std::string given = file(text);
      const bool refused = refuses([&] { read(given); }, "given.yaml", message);
      RC_LOG(text.substr(0, 200));
      RC_LOG(message);
      RC_ASSERT(refused || message == "accepted");
    });
  }
  void expect_mistakes_refused(const std::vector<std::string>& sound,
                               const std::function<void(const std::string&)>& read) const {
    expect_mistakes_refused([&] { return one_of(sound); }, read);
  }
  static std::vector<std::string> presets(const std::string& kind) {
    std::vector<std::string> texts;
    for (const std::string& name : preset_names(kind))
      texts.push_back(read_text(find_preset(kind, kind, name)));
    return texts;
  }

  fs::path root_ = fs::temp_directory_path() / fmt::format("rugae_inputs_{}", getpid());
};

inline std::string some_of(const std::vector<Field>& fields) {
  return mapping_of(fields, [](const Field& f) { return flip() ? value_of(f) : ""; });
}

/// What any frame holds.
inline void check_frame(const CleanFrame& frame) {
  RC_ASSERT(cv::checkRange(frame.radiance, true, nullptr, 0.0, 1e30));
  const FrameTruth& truth = frame.truth;
  for (int y = 0; y < truth.masks.rows; ++y)
    for (int x = 0; x < truth.masks.cols; ++x) {
      const bool valid = truth.masks.at<unsigned char>(y, x) & kMaskValid;
      const float depth = truth.depth_mm.at<float>(y, x);
      RC_ASSERT(valid == std::isfinite(depth));
      RC_ASSERT(!valid || depth > 0.0f);
      const auto n = truth.normal.at<Vec3f>(y, x);
      RC_ASSERT(!valid || std::abs(n.norm() - 1.0f) < 1e-5f);
      RC_ASSERT(valid || frame.radiance.at<Vec3f>(y, x).isZero(0.0f));
      const bool flows = truth.masks.at<unsigned char>(y, x) & kMaskFlowValid;
      RC_ASSERT(flows == truth.flow_px.at<Vec2f>(y, x).allFinite());
    }
}

}  // namespace rugae::test
