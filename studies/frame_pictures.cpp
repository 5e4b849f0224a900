#include "studies/frame_pictures.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "dataset/colours.h"
#include "dataset/frame_sheet.h"
#include "dataset/image_io.h"
#include "dataset/label_images.h"
#include "dataset/layout.h"

namespace rugae {

bool has_label(const CellView& view, const std::string& name, int frame) {
  return std::filesystem::exists(label_image(name).file(DatasetLayout{view.cell.dataset}, frame));
}

FramePictures::FramePictures(const CellView& view, const std::vector<int>& frames) : view_(view) {
  constexpr double kLow = 0.01, kHigh = 0.97, kHighFlow = 0.95;
  cv::Mat depths;
  for (const int i : frames) {
    if (has_label(view, "depth", i)) depths.push_back(view.truth.depth_mm(i));
    if (!has_label(view, "flow", i)) continue;
    cv::Mat parts[2], length;
    cv::split(view.truth.flow_px(i), parts);
    cv::magnitude(parts[0], parts[1], length);
    const double high = quantile(length, kHighFlow);
    if (std::isfinite(high)) longest_flow_px_ = std::max(longest_flow_px_, std::ceil(high));
  }
  const double low = depths.empty() ? std::nan("") : quantile(depths, kLow);
  if (!std::isfinite(low)) return;
  nearest_mm_ = std::floor(low);
  farthest_mm_ = std::max(std::ceil(quantile(depths, kHigh)), nearest_mm_ + 1.0);
}

cv::Mat FramePictures::observation(int frame) const {
  return read_image_bgr(DatasetLayout{view_.cell.dataset}.frame(frame));
}

cv::Mat FramePictures::label(const std::string& name, int frame) const {
  const cv::Mat image = view_.truth.label(name, frame);
  if (name == "depth") return depth_picture(image, nearest_mm_, farthest_mm_);
  if (name == "flow") return flow_picture(image, longest_flow_px_);
  return label_picture(label_image(name), image, observation(frame));
}

}  // namespace rugae
