// C3VD. Values in 16 bits over fixed ranges: depth 0 to 100 mm, normals -1 to 1, flow -20 to 20 px,
// which leads to the frame before. The lowest value of all components means unknown.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "core/in_lots.h"
#include "dataset/export/formats.h"
#include "dataset/image_io.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;

constexpr double kTop = 65535.0, kMostDepth_mm = 100.0, kMostFlow_px = 20.0;

ushort coded(double share) { return static_cast<ushort>(std::lround(kTop * share)); }

// What is farther has the top value, which its readers take for unknown.
cv::Mat depth_code(const cv::Mat& depth_mm) {
  cv::Mat code(depth_mm.size(), CV_16U, cv::Scalar(0));
  for (int y = 0; y < code.rows; ++y)
    for (int x = 0; x < code.cols; ++x) {
      const double z = depth_mm.at<float>(y, x);
      if (z > 0.0) code.at<ushort>(y, x) = coded(std::min(z / kMostDepth_mm, 1.0));
    }
  return code;
}

// x, y and z in red, green and blue.
cv::Mat normal_code(const cv::Mat& normal) {
  cv::Mat code(normal.size(), CV_16UC3, cv::Scalar::all(0));
  for (int y = 0; y < code.rows; ++y)
    for (int x = 0; x < code.cols; ++x) {
      const cv::Vec3f& n = normal.at<cv::Vec3f>(y, x);
      if (!std::isfinite(n[0])) continue;
      for (int axis = 0; axis < 3; ++axis)
        code.at<cv::Vec3w>(y, x)[2 - axis] =
            coded(std::clamp(0.5 * (static_cast<double>(n[axis]) + 1.0), 0.0, 1.0));
    }
  return code;
}

// x and y in red and green. Hidden points have none there, and longer flow cannot be said.
cv::Mat flow_code(const cv::Mat& flow_px, const cv::Mat& masks) {
  cv::Mat code(flow_px.size(), CV_16UC3, cv::Scalar::all(0));
  for (int y = 0; y < code.rows; ++y)
    for (int x = 0; x < code.cols; ++x) {
      const cv::Vec2f& flow = flow_px.at<cv::Vec2f>(y, x);
      const bool hidden = (masks.at<uchar>(y, x) & kMaskBackwardFlowOccluded) != 0;
      const double most = std::max(std::abs(flow[0]), std::abs(flow[1]));
      if (hidden || !(most <= kMostFlow_px)) continue;
      for (int axis = 0; axis < 2; ++axis)
        code.at<cv::Vec3w>(y, x)[2 - axis] = coded(0.5 * (flow[axis] / kMostFlow_px + 1.0));
    }
  return code;
}

// The columns of the homogeneous matrix, one after another.
std::string pose_line(const Rigid3& world_from_camera) {
  const auto m = world_from_camera.matrix3x4();
  std::vector<double> numbers;
  for (int column = 0; column < 4; ++column) {
    for (int row = 0; row < 3; ++row) numbers.push_back(m(row, column));
    numbers.push_back(column == 3 ? 1.0 : 0.0);
  }
  return joined(numbers, ",") + "\n";
}

}  // namespace

std::vector<std::string> export_c3vd(const ExportSource& source, Progress& progress) {
  const LabelSet& has = source.info.truth.labels;
  const auto frames = static_cast<std::size_t>(source.frames());
  // As wide as the last one: readers sort names.
  const std::size_t width = std::max<std::size_t>(4, std::to_string(frames - 1).size());
  const auto file = [&](int frame, const char* what) {
    return source.out / fmt::format("{:0{}}_{}", frame, width, what);
  };
  const bool has_flow = has.backward_flow && has.masks;  // these know what is hidden
  progress.begin("frames", frames);
  do_in_lots(frames, kExportLot, progress, [&](std::size_t i) {
    const int frame = static_cast<int>(i);
    if (source.info.images.jpeg)  // its readers look for PNG
      write_once(file(frame, "color.png"), [&](const fs::path& to) {
        write_image(to, read_image_bgr(source.layout.frame(frame)));
      });
    else
      copy_frame(source, frame, file(frame, "color"));
    if (has.depth)
      write_once(file(frame, "depth.tiff"), [&](const fs::path& to) {
        write_image(to, depth_code(source.truth.depth_mm(frame)));
      });
    if (has.normals)
      write_once(file(frame, "normals.tiff"), [&](const fs::path& to) {
        write_image(to, normal_code(source.truth.normal(frame)));
      });
    if (has_flow && frame > 0)
      write_once(file(frame, "flow.tiff"), [&](const fs::path& to) {
        write_image(to, flow_code(source.truth.backward_flow_px(frame), source.truth.masks(frame)));
      });
  });
  std::string poses;
  for (int frame = 0; frame < source.frames(); ++frame)
    poses += pose_line(source.world_from_camera(frame));
  write_atomic(source.out / "calibration.yaml", read_text(source.layout.calibration()));
  write_atomic(source.out / "pose.txt", poses);

  std::vector<std::string> notes = {
      "the lens is in calibration.yaml, not Scaramuzza's polynomial; no occlusion images"};
  if (!has.depth) notes.push_back("the dataset has no depth: no depth images");
  if (!has.normals) notes.push_back("the dataset has no normals: no images of them");
  if (has_flow)
    notes.push_back("flow of more than 20 px is left out: the format cannot say it");
  else
    notes.push_back(
        "no flow: it leads to the frame before, which a dataset made with --set "
        "truth.backward_flow=true (and masks, which know what is hidden) has");
  return notes;
}

}  // namespace rugae
