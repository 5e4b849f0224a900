#include "dataset/export/export.h"

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>

#include "core/check.h"
#include "dataset/export/formats.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct Format {
  const char *name, *what;
  std::vector<std::string> (*write)(const ExportSource&, Progress&);
  bool fine_depth;  // whose steps can be chosen
};

const std::vector<Format>& formats() {
  static const std::vector<Format> all = {
      {"tum", "TUM RGB-D: rgb/, depth/, associations.txt, groundtruth.txt", export_tum, true},
      {"colmap", "COLMAP: images/, sparse/0 with poses and points", export_colmap, false},
      {"nerfstudio", "nerfstudio: images/, depth/, transforms.json", export_nerfstudio, true},
      {"c3vd", "C3VD: 0000_color.png, 0000_depth.tiff, pose.txt", export_c3vd, false}};
  return all;
}

const Format& format_named(const std::string& name) {
  std::vector<std::string> names;
  for (const Format& format : formats()) {
    if (format.name == name) return format;
    names.push_back(format.name);
  }
  fail("format '{}': no such format{}; known: {}", name, did_you_mean(name, names),
       fmt::join(names, ", "));
}

// Which dataset, and how: a folder with another one in it is not continued.
std::string marker_of(const ExportSource& source, const ExportOptions& options) {
  const Json marker = {{"what", "an export of a rugae dataset; frames are being or were written"},
                       {"format", options.format},
                       {"depth_per_mm", options.depth_per_mm},
                       {"scene", source.info.scene},
                       {"camera", source.info.camera},
                       {"trajectory", source.info.trajectory},
                       {"frames", source.frames()},
                       {"manifest_sha256", sha256_of_file(source.layout.manifest())}};
  return marker.dump(2) + "\n";
}

// What is in a dataset's folder but none of it would make it unsound.
void check_is_outside(const fs::path& out, const fs::path& dataset) {
  const fs::path inner = fs::weakly_canonical(out), outer = fs::weakly_canonical(dataset);
  const auto differ = std::mismatch(outer.begin(), outer.end(), inner.begin(), inner.end());
  check(differ.first != outer.end(), "{}: lies in the dataset, expected a folder outside of it",
        out.string());
}

void take_folder(const fs::path& out, const std::string& marker) {
  make_folder(out);
  const fs::path file = out / "export.json";
  if (fs::exists(file)) {
    check(read_text(file) == marker,
          "{}: holds another export (dataset, format or depth-per-mm differ); choose another "
          "folder or remove it",
          out.string());
    return;
  }
  const auto first = fs::directory_iterator(out);
  check(first == fs::directory_iterator(), "{}: holds {}, expected an empty folder", out.string(),
        first == fs::directory_iterator() ? "" : first->path().filename().string());
  write_atomic(file, marker);
}

}  // namespace

void ExportOptions::check() const {
  const Format& chosen = format_named(format);
  rugae::check(depth_per_mm == 0.0 || (depth_per_mm >= 1.0 && depth_per_mm <= 65535.0),
               "depth-per-mm is {}, expected steps of depth a millimetre, 1 to 65535",
               depth_per_mm);
  rugae::check(depth_per_mm == 0.0 || chosen.fine_depth,
               "depth-per-mm is {}, but {} has no choice of it", depth_per_mm, format);
}

std::vector<ExportFormat> export_formats() {
  std::vector<ExportFormat> list;
  for (const Format& format : formats()) list.push_back({format.name, format.what});
  return list;
}

ExportReport export_dataset(const fs::path& dataset, const ExportOptions& options,
                            const fs::path& out, Progress& progress) {
  options.check();
  ExportSource source;
  source.truth = Truth::open(dataset);
  source.layout = {dataset};
  source.info = read_info(source.layout.info());
  source.out = out;
  source.depth_per_mm = options.depth_per_mm;
  check_is_outside(out, dataset);
  take_folder(out, marker_of(source, options));

  ExportReport report{source.frames(), format_named(options.format).write(source, progress)};
  progress.end();
  if (source.lens().stop.shape != StopShape::full && options.format != "nerfstudio" &&
      options.format != "colmap")
    report.notes.push_back("pixels outside of the field stop are dark, which nothing here says");
  if (options.format != "nerfstudio" && sees_behind(source.lens()))
    report.notes.push_back(
        "the lens sees beyond 90 degrees, where depth along z and most programs' models end");
  if (source.info.truth.row_poses)
    report.notes.push_back(
        "the shutter is a rolling one: a pose is that of the middle row, depth each row's own");
  if (source.truth.wall_moves())
    report.notes.push_back("the wall moves, which the format does not know");
  return report;
}

}  // namespace rugae
