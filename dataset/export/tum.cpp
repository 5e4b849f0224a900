// TUM RGB-D. Its depth images have the wall's z in 1/5000 m, its lists begin with three comments.

#include <fmt/format.h>

#include "dataset/export/formats.h"

namespace rugae {
namespace {

constexpr double kDepthPerMm = 5.0;
constexpr double kMetresPerMm = 1e-3;

std::string header(const std::string& what, const std::string& name, const std::string& columns) {
  return fmt::format("# {}\n# of {}\n# {}\n", what, name, columns);
}

// Readers count pixel centres from 0.
std::string calibration_of(const Lens& lens) {
  const bool fisheye = lens.model == LensModel::kannala_brandt;
  std::vector<double> numbers = {lens.fx, lens.fy, lens.cx - 0.5, lens.cy - 0.5};
  for (const double k : opencv_distortion(lens)) numbers.push_back(k);
  return fmt::format(
      "# {} x {} px, the centre of the first pixel is (0, 0)\n# {}: fx fy cx cy {}\n{}\n",
      lens.width, lens.height, fisheye ? "OpenCV's fisheye model" : "OpenCV's model",
      fisheye ? "k1 k2 k3 k4" : "k1 k2 p1 p2 k3", joined(numbers));
}

}  // namespace

std::vector<std::string> export_tum(const ExportSource& source, Progress& progress) {
  const bool depth = source.info.truth.labels.depth;
  const DepthCode code{source.depth_per_mm > 0.0 ? source.depth_per_mm : kDepthPerMm};
  std::vector<std::string> notes;
  const auto images =
      write_frames(source, "rgb", depth ? std::optional(code) : std::nullopt, progress, notes);

  const std::string name = fmt::format("{}, {}, trajectory {}", source.info.scene,
                                       source.info.camera, source.info.trajectory);
  std::string rgb = header("color images", name, "timestamp filename");
  std::string depths = header("depth maps", name, "timestamp filename");
  std::string pairs,
      poses = header("ground truth trajectory", name, "timestamp tx ty tz qx qy qz qw");
  for (int frame = 0; frame < source.frames(); ++frame) {
    const std::string time = fmt::format("{:.9f}", source.time_s(frame));
    const std::string picture = fmt::format("{} rgb/{}", time, images[frame]);
    const std::string map = fmt::format("{} depth/{:06}.png", time, frame);
    const Rigid3& pose = source.world_from_camera(frame);
    const Vec3 place_m = kMetresPerMm * pose.translation;
    rgb += picture + "\n";
    depths += map + "\n";
    pairs += picture + " " + map + "\n";
    poses += time + " " +
             joined({place_m.x(), place_m.y(), place_m.z(), pose.rotation.x(), pose.rotation.y(),
                     pose.rotation.z(), pose.rotation.w()}) +
             "\n";
  }
  if (depth) {
    write_atomic(source.out / "depth.txt", depths);
    write_atomic(source.out / "associations.txt", pairs);
  }
  // Readers of the list of numbers take its four coefficients for k1 k2 p1 p2.
  const bool fisheye = source.lens().model == LensModel::kannala_brandt;
  write_atomic(source.out / (fisheye ? "calibration_fisheye.txt" : "calibration.txt"),
               calibration_of(source.lens()));
  write_atomic(source.out / "groundtruth.txt", poses);
  write_atomic(source.out / "rgb.txt", rgb);
  if (depth)
    notes.push_back(
        fmt::format("{}: a reader's depth factor is {}", code.text(), code.per_mm / kMetresPerMm));
  if (has_distortion(source.lens()))
    notes.push_back(fmt::format("images are distorted{}: their reader must know",
                                fisheye ? " as a fisheye does" : ""));
  return notes;
}

}  // namespace rugae
