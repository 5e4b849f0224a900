// Frames from inside the stomach and what is known about every pixel of them.

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/check.h"
#include "dataset/colours.h"
#include "dataset/image_io.h"
#include "dataset/layout.h"
#include "studies/html.h"
#include "studies/report_parts.h"

namespace rugae {
namespace {

// `count` frames in equal steps; the last frame of the sequence has no flow and is left out.
std::vector<int> spread(int frames, int count) {
  std::vector<int> chosen;
  const int last = std::max(frames - 2, 0);
  count = std::min(count, last + 1);
  for (int k = 0; k < count; ++k)
    chosen.push_back(static_cast<int>(std::lround((k + 0.5) * last / count)));
  return chosen;
}

struct Range {
  double low, high;
};

// Over all the frames together, so that one far corner does not take all colours.
Range depth_range(const CellView& view, const std::vector<int>& frames) {
  cv::Mat all;
  for (const int i : frames) all.push_back(view.truth.depth_mm(i));
  constexpr double kLow = 0.01, kHigh = 0.97;
  const double low = quantile(all, kLow), high = quantile(all, kHigh);
  if (!std::isfinite(low)) return {0.0, 1.0};
  return {std::floor(low), std::max(std::ceil(high), std::floor(low) + 1.0)};
}

double longest_flow_px(const CellView& view, const std::vector<int>& frames) {
  double longest = 1.0;
  for (const int i : frames) {
    cv::Mat parts[2], length;
    cv::split(view.truth.flow_px(i), parts);
    cv::magnitude(parts[0], parts[1], length);
    const double high = quantile(length, 0.95);
    if (std::isfinite(high)) longest = std::max(longest, high);
  }
  return std::ceil(longest);
}

std::string row(const std::string& name, const std::string& key,
                const std::vector<std::string>& pictures) {
  std::string out =
      "<div class=\"layer\"><div class=\"layer-name\"><b>" + name + "</b>" + key + "</div>";
  for (const std::string& picture : pictures) out += picture;
  return out + "</div>\n";
}

std::string cell_picture(const std::string& uri, const std::string& what, const CellView& view,
                         int frame) {
  const std::string alt =
      fmt::format("{}, frame {} at {:.2f} s", what, frame, view.truth.track()[frame].time_s);
  return fmt::format("<img class=\"zoom\" loading=\"lazy\" src=\"{}\" alt=\"{}\">", uri,
                     html::escape(alt));
}

}  // namespace

std::string cover_picture(const CellView& view) {
  const int frame = view.truth.size() / 3;
  return html::jpeg(read_image_bgr(DatasetLayout{view.cell.dataset}.frame(frame)), 720, 88);
}

std::string frames_part(const CellView& view) {
  const std::vector<int> frames = spread(view.truth.size(), view.many_cells ? 3 : 5);
  const int width_px = view.many_cells ? 400 : 640;
  const Range depth = depth_range(view, frames);
  const double longest = longest_flow_px(view, frames);
  const DatasetLayout layout{view.cell.dataset};
  std::vector<std::string> seen, depths, normals, flows, masks;
  std::string times;
  for (const int i : frames) {
    const cv::Mat bgr = read_image_bgr(layout.frame(i));
    const auto add = [&](std::vector<std::string>& list, const cv::Mat& image, const char* what) {
      list.push_back(cell_picture(html::jpeg(image, width_px), what, view, i));
    };
    add(seen, bgr, "observation");
    add(depths, depth_picture(view.truth.depth_mm(i), depth.low, depth.high), "true depth");
    add(normals, normal_picture(view.truth.normal(i)), "true normals");
    add(flows, flow_picture(view.truth.flow_px(i), longest), "true flow to the next frame");
    add(masks, mask_picture(bgr, view.truth.masks(i)), "label masks");
    times +=
        fmt::format("<span>frame {} &middot; {:.2f} s</span>", i, view.truth.track()[i].time_s);
  }
  std::string out = fmt::format("<div class=\"layers\" style=\"--frames:{}\">", frames.size());
  out += "<div class=\"layer times\"><div></div>" + times + "</div>";
  out += row("What the capsule sees", "<p>8-bit, with noise and fall-off of the light</p>", seen);
  out += row("Depth",
             fmt::format("<p>along the optical axis</p><div class=\"bar\" "
                         "style=\"background:{}\"></div><div class=\"ends\"><span>{:g}</span>"
                         "<span>{:g} mm +</span></div>",
                         depth_gradient_css(), depth.low, depth.high),
             depths);
  out += row("Normals", "<p>red: right, green: up, blue: towards the camera</p>", normals);
  out += row("Flow",
             fmt::format("<p>to the next frame; rim of the disc: {:g} px</p><img class=\"wheel\" "
                         "src=\"{}\" alt=\"flow colours\">",
                         longest, html::png(flow_wheel(96))),
             flows);
  out += row("Masks", "<p>" + mask_key_html() + "</p>", masks);
  return out + "</div>\n";
}

}  // namespace rugae
