// Frames from inside the stomach and what is known about every pixel of them.

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>

#include "core/check.h"
#include "dataset/colours.h"
#include "dataset/image_io.h"
#include "dataset/label_images.h"
#include "dataset/layout.h"
#include "studies/frame_pictures.h"
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

std::vector<int> shown_frames(const CellView& view) {
  return spread(view.truth.size(), view.many_cells ? 3 : 5);
}

std::string cover_picture(const CellView& view) {
  const int frame = view.truth.size() / 3;
  return html::jpeg(read_image_bgr(DatasetLayout{view.cell.dataset}.frame(frame)), 720, 88);
}

std::string frames_part(const CellView& view, const FramePictures& pictures) {
  const std::vector<int> frames = shown_frames(view);
  const int width_px = view.many_cells ? 400 : 640;
  // Pictures of each row by the name of the label; the observations under "".
  std::map<std::string, std::vector<std::string>> rows;
  std::string times;
  for (const int i : frames) {
    const auto add = [&](const std::string& name, const std::string& what, const cv::Mat& image) {
      rows[name].push_back(cell_picture(html::jpeg(image, width_px), what, view, i));
    };
    add("", "observation", pictures.observation(i));
    for (const LabelImage& label : label_images())
      if (has_label(view, label.name, i))
        add(label.name, std::string("true ") + label.what, pictures.label(label.name, i));
    times +=
        fmt::format("<span>frame {} &middot; {:.2f} s</span>", i, view.truth.track()[i].time_s);
  }
  std::string out = fmt::format("<div class=\"layers\" style=\"--frames:{}\">", frames.size());
  out += "<div class=\"layer times\"><div></div>" + times + "</div>";
  out += row("What the capsule sees", "<p>8-bit, with noise and fall-off of the light</p>",
             rows.at(""));
  const auto add_row = [&](const char* label, const std::string& name, const std::string& key) {
    const auto found = rows.find(label);
    if (found != rows.end()) out += row(name, key, found->second);
  };
  add_row("depth", "Depth",
          fmt::format("<p>along the optical axis</p><div class=\"bar\" "
                      "style=\"background:{}\"></div><div class=\"ends\"><span>{:g}</span>"
                      "<span>{:g} mm +</span></div>",
                      depth_gradient_css(), pictures.nearest_mm(), pictures.farthest_mm()));
  add_row("normals", "Normals", "<p>red: right, green: up, blue: towards the camera</p>");
  add_row("flow", "Flow",
          fmt::format("<p>to the next frame; rim of the disc: {:g} px</p><img class=\"wheel\" "
                      "src=\"{}\" alt=\"flow colours\">",
                      pictures.longest_flow_px(), html::png(flow_wheel(96))));
  add_row("masks", "Masks", "<p>" + mask_key_html() + "</p>");
  for (const LabelImage& label : label_images()) {
    const std::string name = label.name;
    if (name == "depth" || name == "normals" || name == "flow" || name == "masks") continue;
    std::string title = label.what;
    title[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(title[0])));
    add_row(label.name, title, "<p><code>truth/" + name + "</code></p>");
  }
  return out + "</div>\n";
}

}  // namespace rugae
