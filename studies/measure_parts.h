#pragma once
// What the measurements of single stages share.

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <opencv2/core/utility.hpp>
#include <optional>
#include <vector>

#include "core/progress.h"
#include "dataset/label_images.h"
#include "recon/options.h"
#include "render/settings.h"

namespace rugae {

/// The value of `count` cases; null where there were none.
inline nlohmann::json known(double value, std::size_t count) {
  return count > 0 ? nlohmann::json(value) : nlohmann::json();
}
inline nlohmann::json known(const std::optional<double>& value) {
  return value ? nlohmann::json(*value) : nlohmann::json();
}

/// Preprocessing that leaves the frames as they are.
PreprocessOptions as_observed();

/// How a dataset was rendered, and which label images it has.
struct DatasetSettings {
  RenderSettings render;
  LabelSet labels;
};
/// From dataset.json; settings that do not stand there have their defaults. Throws Error naming the
/// file.
DatasetSettings dataset_settings(const std::filesystem::path& dataset);

/// Calls add(make(0)), add(make(1)), ... add(make(count - 1)) in this order, `make` by many threads
/// and `add` by the caller's, with at most `kBatch` results in memory. Steps the progress.
///
/// The loop is OpenCV's own: what OpenCV does inside it then stays on one thread, so that a
/// thread's clock sees all of the work of a `make` and nothing of another's.
template <typename Make, typename Add>
void in_batches(int count, Progress& progress, const Make& make, const Add& add) {
  constexpr int kBatch = 64;
  using Result = decltype(make(0));
  for (int begin = 0; begin < count; begin += kBatch) {
    std::vector<Result> results(static_cast<std::size_t>(std::min(kBatch, count - begin)));
    const int size = static_cast<int>(results.size());
    const auto part = [&](const cv::Range& range) {
      for (int k = range.start; k < range.end; ++k)
        results[static_cast<std::size_t>(k)] = make(begin + k);
    };
    cv::parallel_for_(cv::Range(0, size), part, size);
    for (const Result& result : results) add(result);
    progress.step(results.size());
  }
}

}  // namespace rugae
