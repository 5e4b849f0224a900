#include "dataset/export/parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

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

std::string DepthCode::text() const {
  return fmt::format("{} in steps of {:.4g} mm, up to {:.4g} mm",
                     along_ray ? "distance along the ray" : "depth", 1.0 / per_mm, most_mm());
}

namespace {

// Of each pixel's unit ray, CV_32F: depth over it is the distance along the ray. Beyond 90 degrees
// off the axis both are negative. Not a number where the lens has no ray.
cv::Mat ray_z(const Lens& lens) {
  const LensProjector projector(lens);
  cv::Mat z(lens.height, lens.width, CV_32F, cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
  for (int y = 0; y < z.rows; ++y)
    for (int x = 0; x < z.cols; ++x)
      if (const auto ray = projector.unproject({x + 0.5, y + 0.5}))
        z.at<float>(y, x) = static_cast<float>(ray->z());
  return z;
}

// How many pixels are too far is added to `too_far`.
cv::Mat coded(const cv::Mat& depth_mm, double per_mm, std::atomic<std::size_t>& too_far) {
  constexpr double kTop = 65535.0;
  cv::Mat code(depth_mm.size(), CV_16U, cv::Scalar(0));
  for (int y = 0; y < code.rows; ++y)
    for (int x = 0; x < code.cols; ++x) {
      const double steps = std::round(per_mm * depth_mm.at<float>(y, x));
      if (steps > kTop)
        ++too_far;
      else if (steps > 0.0)
        code.at<ushort>(y, x) = static_cast<ushort>(steps);
    }
  return code;
}

}  // namespace

std::vector<std::string> write_frames(const ExportSource& source, const std::string& images,
                                      const std::optional<DepthCode>& depth, Progress& progress,
                                      std::vector<std::string>& notes) {
  make_folder(source.out / images);
  if (depth) make_folder(source.out / "depth");
  std::vector<std::string> names(source.frames());
  std::atomic<std::size_t> too_far = 0;
  const cv::Mat z = depth && depth->along_ray ? ray_z(source.lens()) : cv::Mat();
  progress.begin("frames", names.size());
  do_in_lots(names.size(), kExportLot, progress, [&](std::size_t i) {
    const int frame = static_cast<int>(i);
    const std::string stem = fmt::format("{:06}", frame);
    names[i] = copy_frame(source, frame, source.out / images / stem);
    if (!depth) return;
    write_once(source.out / "depth" / (stem + ".png"), [&](const auto& file) {
      cv::Mat depth_mm = source.truth.depth_mm(frame);
      if (depth->along_ray) cv::divide(depth_mm, z, depth_mm);
      write_image(file, coded(depth_mm, depth->per_mm, too_far));
    });
  });
  if (too_far > 0)
    notes.push_back(fmt::format("{} pixels are farther than {:.4g} mm: 0 there", too_far.load(),
                                depth->most_mm()));
  return names;
}

cv::Mat stop_mask(const Lens& lens) {
  cv::Mat mask(lens.height, lens.width, CV_8U, cv::Scalar(0));
  for (int y = 0; y < mask.rows; ++y)
    for (int x = 0; x < mask.cols; ++x)
      if (lens.passes_stop({x + 0.5, y + 0.5})) mask.at<uchar>(y, x) = 255;
  return mask;
}

bool sees_behind(const Lens& lens) {
  const LensProjector projector(lens);
  for (int y = 0; y < lens.height; ++y)
    for (int x = 0; x < lens.width; ++x) {
      const Vec2 pixel(x + 0.5, y + 0.5);
      const auto ray = projector.unproject(pixel);
      if (ray && !(ray->z() > 0.0) && lens.passes_stop(pixel)) return true;
    }
  return false;
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
