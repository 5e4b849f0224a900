// A sparse model of COLMAP. Its images have cam_from_world, its pixels are ours: the centre of the
// first one is (0.5, 0.5).

#include <fmt/format.h>

#include <fstream>

#include "core/check.h"
#include "dataset/export/formats.h"
#include "dataset/export/points.h"
#include "dataset/image_io.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;

// The smallest of its models that is exactly ours, and its parameters.
std::string camera_line(const Lens& lens) {
  std::string model;
  std::vector<double> numbers = {lens.fx, lens.fy, lens.cx, lens.cy};
  const auto append = [&](std::vector<double> more) {
    numbers.insert(numbers.end(), more.begin(), more.end());
  };
  if (lens.model == LensModel::kannala_brandt) {
    model = "OPENCV_FISHEYE";
    append({lens.k1, lens.k2, lens.k3, lens.k4});
  } else if (!has_distortion(lens)) {
    model = "PINHOLE";
  } else if (lens.k3 == 0.0) {
    model = "OPENCV";
    append({lens.k1, lens.k2, lens.p1, lens.p2});
  } else {
    model = "FULL_OPENCV";  // radial: (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + ...)
    append({lens.k1, lens.k2, lens.p1, lens.p2, lens.k3, 0.0, 0.0, 0.0});
  }
  return fmt::format("1 {} {} {} {}\n", model, lens.width, lens.height, joined(numbers));
}

// A file that grows as frames are written.
class LongText {
 public:
  explicit LongText(fs::path file) : file_(std::move(file)), stream_(temporary_for(file_)) {}
  void add(const std::string& text) { stream_ << text; }
  void finish() {
    stream_.close();
    check(!stream_.fail(), "{}: cannot be written", file_.string());
    publish(file_);
  }

 private:
  fs::path file_;
  std::ofstream stream_;
};

}  // namespace

std::vector<std::string> export_colmap(const ExportSource& source, Progress& progress) {
  const fs::path sparse = source.out / "sparse" / "0";
  make_folder(sparse);
  std::vector<std::string> notes;
  const auto names = write_frames(source, "images", std::nullopt, progress, notes);
  if (source.lens().stop.shape != StopShape::full) {  // for --ImageReader.mask_path
    make_folder(source.out / "masks");
    const cv::Mat mask = stop_mask(source.lens());
    for (const std::string& name : names)
      write_once(source.out / "masks" / (name + ".png"),
                 [&](const fs::path& file) { write_image(file, mask); });
    notes.push_back("masks/ has the field stop, for --ImageReader.mask_path");
  }
  const WallPoints wall(source, progress);
  progress.begin("sparse model", names.size());
  std::vector<std::string> tracks(
      wall.points().size());  // " image, place among its points" for each that sees it
  LongText list(sparse / "images.txt");
  list.add("# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME\n# POINTS2D[] as X Y POINT3D_ID\n");
  for (int frame = 0; frame < source.frames(); ++frame) {
    const Rigid3 cam_from_world = source.world_from_camera(frame).inverse();
    const Quat& q = cam_from_world.rotation;
    const Vec3& t = cam_from_world.translation;
    std::string line =
        fmt::format("{} {} 1 {}\n", frame + 1,
                    joined({q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()}), names[frame]);
    int place = 0;
    for (const WallPoints::Seen& seen : wall.seen_in(frame)) {
      line += fmt::format("{}{} {} {}", place > 0 ? " " : "", seen.pixel.x(), seen.pixel.y(),
                          seen.point + 1);
      tracks[seen.point] += fmt::format(" {} {}", frame + 1, place++);
    }
    list.add(line + "\n");
    progress.step();
  }
  LongText points(sparse / "points3D.txt");
  points.add("# POINT3D_ID X Y Z R G B ERROR TRACK[] as IMAGE_ID POINT2D_IDX\n");
  for (std::size_t i = 0; i < wall.points().size(); ++i) {
    const ColouredPoint& point = wall.points()[i];
    points.add(fmt::format("{} {} {} {} {} 0{}\n", i + 1,
                           joined({point.place_mm.x(), point.place_mm.y(), point.place_mm.z()}),
                           point.color[0], point.color[1], point.color[2], tracks[i]));
  }
  points.finish();
  list.finish();
  write_atomic(sparse / "cameras.txt",
               "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n" + camera_line(source.lens()));

  if (!wall.note().empty()) notes.push_back(wall.note());
  if (has_distortion(source.lens()))
    notes.push_back("images are distorted: colmap image_undistorter makes pinhole ones");
  return notes;
}

}  // namespace rugae
