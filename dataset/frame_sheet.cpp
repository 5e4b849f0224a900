#include "dataset/frame_sheet.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/check.h"
#include "dataset/colours.h"
#include "dataset/image_io.h"
#include "dataset/label_images.h"
#include "dataset/writer.h"

namespace rugae {
namespace {

const cv::Scalar kPage(30, 28, 27), kInk(225, 225, 225);  // BGR
constexpr int kGap_px = 8, kCaption_px = 26;

// Up to this share of the pixels the colours tell apart; the rest are as bright as the brightest.
constexpr double kUpTo = 0.97;

cv::Mat depth_tile(const cv::Mat& depth) {
  return depth_picture(depth, quantile(depth, 0.01), quantile(depth, kUpTo));
}

cv::Mat flow_tile(const cv::Mat& flow_px) {
  cv::Mat parts[2], length;
  cv::split(flow_px, parts);
  cv::magnitude(parts[0], parts[1], length);
  return flow_picture(flow_px, std::max(1.0, quantile(length, kUpTo)));
}

// Light as an image of its own: the brightest 1 % may clip.
cv::Mat light_tile(const cv::Mat& light) {
  cv::Mat bgr;
  if (light.channels() == 1)
    cv::cvtColor(light, bgr, cv::COLOR_GRAY2BGR);
  else
    cv::cvtColor(light, bgr, cv::COLOR_RGB2BGR);
  const double top = std::max(1e-9, quantile(bgr.reshape(1), 0.99));
  bgr = cv::max(bgr, 0.0) / top;
  cv::pow(cv::min(bgr, 1.0), 1.0 / 2.2, bgr);
  bgr.convertTo(bgr, CV_8UC3, 255.0);
  return bgr;
}

}  // namespace

cv::Mat label_picture(const LabelImage& label, const cv::Mat& image, const cv::Mat& bgr) {
  const auto is = [&label](bool LabelSet::*member) { return label.wanted == member; };
  if (is(&LabelSet::depth) || is(&LabelSet::range)) return depth_tile(image);
  if (is(&LabelSet::flow) || is(&LabelSet::backward_flow)) return flow_tile(image);
  if (is(&LabelSet::masks)) return mask_picture(bgr, image);
  if (is(&LabelSet::triangles) || label.type == CV_8UC1) return number_picture(image);
  if (label.coding == LabelCoding::normals) return normal_picture(image);
  return light_tile(image);
}

std::vector<SheetTile> label_tiles(const std::filesystem::path& dataset, int frame) {
  // A dataset of which one frame was made is good enough.
  const DatasetLayout layout{dataset};
  const int frames = read_info(layout.info()).frames;
  check(frame >= 0 && frame < frames, "{}: frame {}, expected 0 to {}", dataset.string(), frame,
        frames - 1);
  const cv::Mat bgr = read_image_bgr(layout.frame(frame));
  std::vector<SheetTile> tiles;
  for (const LabelImage& label : label_images()) {
    const std::filesystem::path file = label.file(layout, frame);
    if (!std::filesystem::exists(file)) continue;
    const cv::Mat image = label.read(file);
    check(image.type() == label.type && image.size() == bgr.size(), "{}: not of the frame's size",
          file.string());
    tiles.push_back({label.name, label_picture(label, image, bgr)});
  }
  return tiles;
}

cv::Mat sheet(const std::vector<SheetTile>& tiles, int columns, int tile_width_px) {
  check(!tiles.empty(), "a sheet of no pictures");
  check(columns >= 1 && tile_width_px >= 16, "a sheet of {} columns of {} px, expected 1 and 16",
        columns, tile_width_px);
  columns = std::min(columns, static_cast<int>(tiles.size()));
  const int tile_height_px = 3 * tile_width_px / 4;
  const int rows = (static_cast<int>(tiles.size()) + columns - 1) / columns;
  const int step_x = tile_width_px + kGap_px, step_y = tile_height_px + kCaption_px + kGap_px;
  cv::Mat page(kGap_px + rows * step_y, kGap_px + columns * step_x, CV_8UC3, kPage);
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    const cv::Mat& picture = tiles[i].bgr;
    const double scale = std::min(static_cast<double>(tile_width_px) / picture.cols,
                                  static_cast<double>(tile_height_px) / picture.rows);
    const cv::Size size(std::max(1, static_cast<int>(std::lround(scale * picture.cols))),
                        std::max(1, static_cast<int>(std::lround(scale * picture.rows))));
    cv::Mat scaled;
    cv::resize(picture, scaled, size, 0.0, 0.0, scale < 1.0 ? cv::INTER_AREA : cv::INTER_LINEAR);
    const int column = static_cast<int>(i) % columns, row = static_cast<int>(i) / columns;
    const cv::Point corner(kGap_px + column * step_x + (tile_width_px - size.width) / 2,
                           kGap_px + row * step_y + (tile_height_px - size.height) / 2);
    scaled.copyTo(page(cv::Rect(corner, size)));
    cv::putText(page, tiles[i].caption,
                {kGap_px + column * step_x + 2, kGap_px + row * step_y + tile_height_px + 18},
                cv::FONT_HERSHEY_SIMPLEX, 0.45, kInk, 1, cv::LINE_AA);
  }
  return page;
}

}  // namespace rugae
