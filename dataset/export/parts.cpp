#include "dataset/export/parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/in_lots.h"
#include "dataset/image_io.h"

namespace rugae {

std::string copy_frame(const ExportSource& source, int frame, const std::filesystem::path& stem) {
  const std::filesystem::path from = source.layout.frame(frame);
  std::filesystem::path to = stem;
  to += from.extension();
  write_once(to, [&](const auto& file) { write_atomic(file, read_text(from)); });
  return to.filename().string();
}

cv::Mat coded_depth(const cv::Mat& depth_mm, double per_mm) {
  constexpr double kTop = 65535.0;
  cv::Mat code(depth_mm.size(), CV_16U);
  for (int y = 0; y < code.rows; ++y)
    for (int x = 0; x < code.cols; ++x) {
      const double steps = std::round(per_mm * depth_mm.at<float>(y, x));
      code.at<ushort>(y, x) = steps > 0.0 && steps <= kTop ? static_cast<ushort>(steps) : 0;
    }
  return code;
}

std::vector<std::string> write_frames(const ExportSource& source, const std::string& images,
                                      double depth_per_mm, Progress& progress) {
  make_folder(source.out / images);
  if (depth_per_mm > 0.0) make_folder(source.out / "depth");
  std::vector<std::string> names(source.frames());
  progress.begin("frames", names.size());
  do_in_lots(names.size(), kExportLot, progress, [&](std::size_t i) {
    const int frame = static_cast<int>(i);
    const std::string stem = fmt::format("{:06}", frame);
    names[i] = copy_frame(source, frame, source.out / images / stem);
    if (!(depth_per_mm > 0.0)) return;
    write_once(source.out / "depth" / (stem + ".png"), [&](const auto& file) {
      write_image(file, coded_depth(source.truth.depth_mm(frame), depth_per_mm));
    });
  });
  return names;
}

std::vector<double> opencv_distortion(const Lens& lens) {
  if (lens.model == LensModel::kannala_brandt) return {lens.k1, lens.k2, lens.k3, lens.k4};
  return {lens.k1, lens.k2, lens.p1, lens.p2, lens.k3};
}

bool has_distortion(const Lens& lens) {
  return lens.model == LensModel::kannala_brandt ||
         std::ranges::any_of(opencv_distortion(lens), [](double k) { return k != 0.0; });
}

std::string joined(const std::vector<double>& numbers, const std::string& between) {
  std::vector<std::string> words;
  for (const double number : numbers) words.push_back(fmt::format("{}", number));
  return fmt::format("{}", fmt::join(words, between));
}

}  // namespace rugae
