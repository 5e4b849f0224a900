#pragma once
// Pictures side by side with their names: what a frame and its labels look like.

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "dataset/label_images.h"

namespace rugae {

struct SheetTile {
  std::string caption;
  cv::Mat bgr;  // CV_8UC3
};

/// A label of a frame as a picture of its own; `bgr` is the frame. Colours: dataset/colours.h.
cv::Mat label_picture(const LabelImage& label, const cv::Mat& image, const cv::Mat& bgr);

/// Every label that the dataset holds for a frame, as a picture.
std::vector<SheetTile> label_tiles(const std::filesystem::path& dataset, int frame);

/// The tiles row by row, each scaled into `tile_width_px` by three quarters of it, on a dark page,
/// its caption below it. CV_8UC3.
cv::Mat sheet(const std::vector<SheetTile>& tiles, int columns, int tile_width_px = 400);

}  // namespace rugae
