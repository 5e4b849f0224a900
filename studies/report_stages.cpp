// The pictures a reconstruction leaves of its stages: ESTIMATE/pictures/<stage>/<name>.png.

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "core/check.h"
#include "dataset/image_io.h"
#include "studies/html.h"
#include "studies/report_parts.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;

struct Stage {
  const char* folder;
  const char* caption;
};
// Stages that belong together stand in one row a picture; the row's pictures share their name.
struct Group {
  const char* title;
  const char* intro;
  std::vector<Stage> stages;
  bool slider = false;  // the first row's first and last picture also as one to slide over
};

const std::vector<Group>& groups() {
  static const std::vector<Group> kGroups = {
      {"Preprocessing",
       "Reflections are found where the image is bright and steep, painted over for the map (not "
       "for the path), the lens straightened, the fall-off towards the corners taken out.",
       {{"original", "as observed"},
        {"mask", "reflections found"},
        {"inpainted", "painted over"},
        {"preprocessed", "straightened, fall-off removed"}},
       true},
      {"Pairs of key frames",
       "Dense flow proposes matches; a homography by RANSAC keeps the consistent ones.",
       {{"flow", "flow: hue is direction, strength is length"},
        {"inliers", "inliers, drawn from one key frame to the next"}}},
      {"Tracks",
       "Points followed over several key frames and placed in space by bundle adjustment; blue are "
       "seen by few key frames, red by many.",
       {{"tracks", "placed points"}}},
      {"Links between key frames",
       "How many points each two key frames share, in the order of time: a chain is a diagonal, "
       "what "
       "is off it was seen again.",
       {{"links", "bright: many"}}},
      {"Stereo",
       "Key frames compared with others around them; a depth counts where other depth maps agree.",
       {{"wide", "all that the lens sees"},
        {"stereo", "depth as found: bright near, dark far"},
        {"agreed", "what others agree with"},
        {"sigma", "its standard deviation over the depth: bright, little"}}},
      {"Mosaics",
       "Key frames that look the same way, blended into one picture, and its relief from shading.",
       {{"mosaic", "mosaic"},
        {"seams", "with its seams"},
        {"depth", "depth: bright near, dark far"}}}};
  return kGroups;
}

using StageFiles = std::map<std::string, std::map<std::string, fs::path>>;  // folder, name, file

StageFiles files_of(const fs::path& root) {
  StageFiles files;
  if (!fs::is_directory(root)) return files;
  for (const auto& entry : fs::recursive_directory_iterator(root))
    if (entry.path().extension() == ".png")
      files[entry.path().parent_path().filename().string()][entry.path().stem().string()] =
          entry.path();
  return files;
}

// `count` names in equal steps.
std::vector<std::string> spread(const std::map<std::string, fs::path>& files, std::size_t count) {
  std::vector<std::string> all, chosen;
  for (const auto& [name, file] : files) all.push_back(name);
  count = std::min(count, all.size());
  for (std::size_t k = 0; k < count; ++k)
    chosen.push_back(all[(2 * k + 1) * all.size() / (2 * count)]);
  return chosen;
}

std::string slider(const fs::path& before, const fs::path& after) {
  return fmt::format(
      "<figure class=\"slide\"><div class=\"compare\"><img src=\"{}\" alt=\"before\"><img "
      "src=\"{}\" "
      "alt=\"after\"><input type=\"range\" min=\"0\" max=\"100\" value=\"50\" aria-label=\"share "
      "of "
      "the picture shown before\"><span class=\"before\">before</span><span class=\"after\">after"
      "</span></div><figcaption>Slide to compare: a frame as observed, and as the map sees it."
      "</figcaption></figure>\n",
      html::jpeg(read_image_bgr(before)), html::jpeg(read_image_bgr(after)));
}

// "000012" -> "frame 12", "000012-000018" -> "frames 12 and 18", "003" -> "no. 3".
std::string readable(const std::string& name) {
  const auto number = [](const std::string& digits) {
    const auto first = digits.find_first_not_of('0');
    return first == std::string::npos ? std::string("0") : digits.substr(first);
  };
  const auto is_number = [](const std::string& text) {
    return !text.empty() && text.find_first_not_of("0123456789") == std::string::npos;
  };
  constexpr std::size_t kFrameDigits = 6;
  if (is_number(name)) return (name.size() == kFrameDigits ? "frame " : "no. ") + number(name);
  const auto dash = name.find('-');
  if (dash == kFrameDigits && is_number(name.substr(0, dash)) && is_number(name.substr(dash + 1)))
    return "frames " + number(name.substr(0, dash)) + " and " + number(name.substr(dash + 1));
  return name;
}

std::string figure_of(const fs::path& file, const std::string& caption, int width_px) {
  return html::figure(html::jpeg(read_image_bgr(file), width_px), caption, html::escape(caption));
}

std::string group_html(const Group& group, const StageFiles& files, bool small) {
  const auto first = files.find(group.stages.front().folder);
  if (first == files.end() || first->second.empty()) return {};
  constexpr std::size_t kColumns = 4;
  const std::size_t rows = small ? 1 : group.stages.size() >= 3 ? 3 : kColumns;
  std::string out = fmt::format("<h4>{}</h4><p class=\"intro\">{}</p>\n", group.title, group.intro);
  const std::vector<std::string> names = spread(first->second, rows);
  if (group.slider && !small) {
    const auto last = files.find(group.stages.back().folder);
    if (last != files.end() && last->second.contains(names.front()))
      out += slider(first->second.at(names.front()), last->second.at(names.front()));
  }
  const std::size_t columns =
      group.stages.size() * std::max<std::size_t>(1, kColumns / group.stages.size());
  out += fmt::format("<div class=\"figures\" style=\"--columns:{}\">\n", columns);
  for (const std::string& name : names)
    for (const Stage& stage : group.stages) {
      const auto of_stage = files.find(stage.folder);
      const bool there = of_stage != files.end() && of_stage->second.contains(name);
      out +=
          there ? figure_of(of_stage->second.at(name),
                            fmt::format("{}: {}", readable(name), stage.caption), small ? 400 : 560)
                : std::string("<figure></figure>\n");
    }
  return out + "</div>\n";
}

}  // namespace

std::string stages_part(const CellView& view) {
  const StageFiles files = files_of(EstimateLayout{view.cell.estimate}.pictures());
  std::string out;
  std::set<std::string> shown{"pose"};  // the gray twin of "original" tells nothing new
  for (const Group& group : groups()) {
    out += group_html(group, files, view.many_cells);
    for (const Stage& stage : group.stages) shown.insert(stage.folder);
  }
  // Stages of other methods, as they come.
  for (const auto& [folder, pictures] : files) {
    if (shown.contains(folder)) continue;
    out += "<h4>" + html::escape(folder) + "</h4><div class=\"figures\" style=\"--columns:4\">\n";
    for (const std::string& name : spread(pictures, 4))
      out += figure_of(pictures.at(name), name, view.many_cells ? 400 : 560);
    out += "</div>\n";
  }
  return out;
}

}  // namespace rugae
