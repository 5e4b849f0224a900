#include "dataset/writer.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/check.h"
#include "core/files.h"
#include "core/mesh_io.h"
#include "dataset/frame_list.h"
#include "dataset/image_io.h"
#include "dataset/manifest.h"
#include "dataset/ply_io.h"

namespace rugae {
namespace fs = std::filesystem;
using nlohmann::json;
namespace {

constexpr int kLayoutVersion = 2;  // raised when readers of the layout must change

json names_of(const TruthFiles& truth) {
  json names = json::array();
  for (const LabelImage& label : label_images())
    if (truth.labels.*label.wanted) names.push_back(label.name);
  if (truth.row_poses) names.push_back("row_poses");
  if (truth.wall_motion) names.push_back("wall_motion");
  if (truth.tracks) names.push_back("tracks");
  if (truth.coverage) names.push_back("coverage");
  return names;
}

json names_of(const ImageFiles& images) {
  json names = json::array();
  names.push_back(images.jpeg ? "jpeg" : "png");
  if (images.adc) names.push_back("adc");
  if (images.mosaic) names.push_back("mosaic");
  if (images.radiance) names.push_back("radiance");
  if (images.clean) names.push_back("clean");
  return names;
}

// What a list in dataset.json names.
class Names {
 public:
  Names(const json& object, const char* key)
      : names_(object.at(key).get<std::vector<std::string>>()) {}
  bool has(const char* name) const { return std::ranges::find(names_, name) != names_.end(); }

 private:
  std::vector<std::string> names_;
};

TruthFiles truth_named(const Names& names) {
  TruthFiles truth{.labels = {},
                   .row_poses = names.has("row_poses"),
                   .wall_motion = names.has("wall_motion"),
                   .tracks = names.has("tracks"),
                   .coverage = names.has("coverage")};
  for (const LabelImage& label : label_images()) truth.labels.*label.wanted = names.has(label.name);
  return truth;
}

// The quality of JPEG stands among the options: no reader needs it.
ImageFiles images_named(const Names& names) {
  ImageFiles images;
  images.jpeg = names.has("jpeg");
  images.adc = names.has("adc");
  images.mosaic = names.has("mosaic");
  images.radiance = names.has("radiance");
  images.clean = names.has("clean");
  return images;
}

json as_json(const DatasetInfo& info) {
  json options = json::object();
  if (!info.text.empty()) {
    options = json::parse(info.text, nullptr, false);
    check(options.is_object(), "the options of a dataset are not a JSON object: {}", info.text);
  }
  return {{"layout_version", kLayoutVersion},
          {"scene", info.scene},
          {"camera", info.camera},
          {"trajectory", info.trajectory},
          {"resolution", info.resolution},
          {"seed", info.seed},
          {"frames", info.frames},
          {"images", names_of(info.images)},
          {"truth", names_of(info.truth)},
          {"options", options},
          {"units", {{"length", "mm"}, {"time", "s"}, {"flow", "px"}}},
          {"axes",
           {{"camera", "x right, y down, z forward"},
            {"pixel", "the centre of the first pixel is (0.5, 0.5)"},
            {"pose", "world_from_camera"}}}};
}

std::string shown(const json& object, const std::string& key) {
  return object.contains(key) ? object[key].dump() : "absent";
}

// The first thing in which two infos differ, as "seed is 1, now 2".
std::string difference(const json& found, const json& now) {
  for (const auto& object : {now, found})
    for (const auto& [key, value] : object.items()) {
      if (shown(found, key) == shown(now, key)) continue;
      if (value.is_object() && found.contains(key) && now.contains(key))
        return key + ": " + difference(found[key], now[key]);
      return fmt::format("{} is {}, now {}", key, shown(found, key), shown(now, key));
    }
  return "written differently";
}

json read_json(const fs::path& file) {
  json object = json::parse(read_text(file), nullptr, false);
  check(object.is_object(), "{}: not a JSON object", file.string());
  return object;
}

// Only an empty folder may become a dataset: nothing of the user's is to end up in its manifest.
void check_empty(const fs::path& root) {
  for (const auto& entry : fs::directory_iterator(root))
    check(is_temporary(entry.path()),
          "{}: is neither empty nor a dataset (it holds '{}'); choose another folder",
          root.string(), entry.path().filename().string());
}

void remove_temporaries(const fs::path& root) {
  for (const std::string& file : files_below(root, ""))
    if (is_temporary(file)) fs::remove(root / file);
}

bool same_mesh(const TriangleMesh& a, const TriangleMesh& b) {
  return a.vertices == b.vertices && a.triangles == b.triangles;
}

}  // namespace

std::string info_json(const DatasetInfo& info) { return as_json(info).dump(2) + "\n"; }

DatasetInfo read_info(const fs::path& file) {
  const json object = read_json(file);
  DatasetInfo info;
  try {
    const int version = object.at("layout_version").get<int>();
    check(version == kLayoutVersion, "{}: layout version {}, this program reads {}", file.string(),
          version, kLayoutVersion);
    object.at("scene").get_to(info.scene);
    object.at("camera").get_to(info.camera);
    object.at("trajectory").get_to(info.trajectory);
    object.at("resolution").get_to(info.resolution);
    object.at("seed").get_to(info.seed);
    object.at("frames").get_to(info.frames);
    info.images = images_named({object, "images"});
    info.truth = truth_named({object, "truth"});
    info.text = object.at("options").dump();
  } catch (const json::exception& error) {
    fail("{}: not the description of a dataset: {}", file.string(), error.what());
  }
  return info;
}

DatasetWriter::DatasetWriter(const fs::path& root, const DatasetInfo& info) : info_(info) {
  layout_.root = root;
  check(info.frames >= 1, "{}: a dataset of {} frames, expected at least 1", root.string(),
        info.frames);
  const std::string text = info_json(info);
  make_folder(root);
  if (fs::exists(layout_.info())) {
    if (read_text(layout_.info()) != text)
      fail("{}: holds another dataset ({}); choose another folder or remove it", root.string(),
           difference(read_json(layout_.info()), json::parse(text)));
    remove_temporaries(root);
  } else {
    check_empty(root);
    write_atomic(layout_.info(), text);
  }
  make_folder(layout_.frames());
  make_folder(layout_.truth());
  for (const int index : {0, 1, info.frames - 1})
    for (const fs::path& file : files_of_frame(layout_, info, index))
      make_folder(file.parent_path());
}

void DatasetWriter::write_scene(const Camera& camera, const PoseTrack& track,
                                const TriangleMesh& wall) {
  check(static_cast<int>(track.size()) == info_.frames, "{}: a path of {} poses for {} frames",
        layout_.root.string(), track.size(), info_.frames);
  const auto write_same = [](const fs::path& file, const std::string& text) {
    check(!fs::exists(file) || read_text(file) == text,
          "{}: differs from this run's; choose another folder or remove it", file.string());
    write_atomic(file, text);
  };
  write_same(layout_.camera(), camera_yaml(camera));
  write_same(layout_.trajectory(), tum_text(track));
  Calibration calibration{camera.lens, {}, {}};
  if (info_.truth.row_poses) calibration.row_time_us = camera.sensor.row_time_us;
  if (!all_central(camera.lights)) calibration.lights = camera.lights;
  write_same(layout_.calibration(), calibration_yaml(calibration, "calibration of " + camera.name));
  check(!fs::exists(layout_.wall()) || same_mesh(read_ply(layout_.wall()), wall),
        "{}: differs from this run's; choose another folder or remove it", layout_.wall().string());
  write_ply(layout_.wall(), wall, true);
  track_ = track;
  width_ = camera.lens.width;
  height_ = camera.lens.height;
}

std::vector<fs::path> files_of_frame(const DatasetLayout& layout, const DatasetInfo& info,
                                     int index) {
  std::vector<fs::path> files;
  for (const LabelImage& label : label_images())
    if (info.truth.labels.*label.wanted && label.exists_for(index, info.frames))
      files.push_back(label.file(layout, index));
  if (info.truth.tracks) files.push_back(layout.tracks(index));
  if (info.truth.row_poses) files.push_back(layout.row_poses(index));
  if (info.truth.wall_motion) files.push_back(layout.wall_motion(index));
  const std::vector<fs::path> images = image_files(layout, info.images, index);
  files.insert(files.end(), images.begin(), images.end());
  return files;
}

void DatasetWriter::write_track_points(const std::vector<TrackPoint>& points) const {
  write_atomic(layout_.track_points(), track_points_text(points));
}

void DatasetWriter::check_finished() const {
  if (!fs::exists(layout_.manifest())) return;
  const auto listed = read_manifest(layout_.manifest());
  const auto files = files_below(layout_.root, layout_.manifest().filename().string());
  const auto hashes = hashes_of(layout_.root, files);
  for (std::size_t i = 0; i < files.size(); ++i) {
    const auto entry = listed.find(files[i]);
    const std::string file = (layout_.root / files[i]).string();
    check(entry != listed.end(), "{}: is none of this finished dataset's files; move it elsewhere",
          file);
    check(
        entry->second == hashes[i],
        "{}: changed since the dataset was finished; remove it, and the same command makes it anew",
        file);
  }
}

bool DatasetWriter::has_frame(int index) const {
  return std::ranges::all_of(files_of_frame(layout_, info_, index),
                             [](const fs::path& file) { return fs::exists(file); });
}

void DatasetWriter::write_frame(int index, const cv::Mat& bgr8, const FrameTruth& truth,
                                const ExtraImages& extra) const {
  check(index >= 0 && index < info_.frames, "frame {}: the dataset has {} frames", index,
        info_.frames);
  check(bgr8.type() == CV_8UC3 && (width_ == 0 || (bgr8.cols == width_ && bgr8.rows == height_)),
        "frame {}: image is {} x {} of {}, expected {} x {} of CV_8UC3", index, bgr8.cols,
        bgr8.rows, cv::typeToString(bgr8.type()), width_, height_);
  for (const LabelImage& label : label_images()) {
    if (!(info_.truth.labels.*label.wanted) || !label.exists_for(index, info_.frames)) continue;
    const cv::Mat& image = truth.*label.image;
    check(image.type() == label.type && image.size() == bgr8.size(),
          "frame {}: {} is {} x {} of {}, expected {} x {} of {}", index, label.what, image.cols,
          image.rows, cv::typeToString(image.type()), bgr8.cols, bgr8.rows,
          cv::typeToString(label.type));
    label.write(label.file(layout_, index), image);
  }
  if (info_.truth.tracks) write_atomic(layout_.tracks(index), tracks_text(truth.tracks));
  if (info_.truth.row_poses) write_atomic(layout_.row_poses(index), tum_text(truth.row_poses));
  if (info_.truth.wall_motion) {
    TriangleMesh points;
    for (const Vec3f& d : truth.wall_displacement_mm) points.vertices.push_back(d.cast<double>());
    write_ply(layout_.wall_motion(index), points);
  }
  write_images(layout_, info_.images, index, bgr8, extra);
}

void DatasetWriter::finish(const std::vector<double>& exposure_s,
                           const std::vector<double>& gain) const {
  const auto frames = static_cast<std::size_t>(info_.frames);
  check(track_.size() == frames, "{}: the scene was not written", layout_.root.string());
  check(exposure_s.size() == frames && gain.size() == frames,
        "{}: {} exposures and {} gains for {} frames", layout_.root.string(), exposure_s.size(),
        gain.size(), frames);
  std::vector<FrameRecord> records;
  for (std::size_t i = 0; i < frames; ++i) {
    check(has_frame(static_cast<int>(i)), "{}: frame {} was not written", layout_.root.string(), i);
    records.push_back({track_[i].time_s, exposure_s[i], gain[i]});
  }
  write_atomic(layout_.frame_list(), frame_list_text(records));
  if (info_.truth.coverage) {
    std::vector<fs::path> triangles;
    for (int i = 0; i < info_.frames; ++i) triangles.push_back(layout_.triangles(i));
    write_atomic(layout_.coverage(), coverage_text(triangles));
  }
  remove_temporaries(layout_.root);
  const auto files = files_below(layout_.root, layout_.manifest().filename().string());
  write_atomic(layout_.manifest(), manifest_text(files, hashes_of(layout_.root, files)));
}

}  // namespace rugae
