#include "dataset/truth.h"

#include "core/check.h"
#include "dataset/label_images.h"
#include "dataset/ply_io.h"
#include "dataset/writer.h"

namespace rugae {
RowPoses read_row_poses(const std::filesystem::path& file, const Camera& camera) {
  const PoseTrack track = read_tum(file);
  check(static_cast<int>(track.size()) == camera.lens.height + 2 &&
            camera.sensor.shutter == Shutter::rolling,
        "{}: {} poses, expected one a row and one beyond either border ({}) of a rolling shutter",
        file.string(), track.size(), camera.lens.height + 2);
  std::vector<Rigid3> poses;
  for (const TimedPose& pose : track) poses.push_back(pose.world_from_camera);
  return {std::move(poses), 1e-6 * camera.sensor.row_time_us};
}

TriangleMesh moved_wall(const TriangleMesh& rest, const std::filesystem::path& file) {
  const std::vector<Vec3> displacement_mm = read_ply(file).vertices;
  check(displacement_mm.size() == rest.vertices.size(),
        "{}: {} vertices, expected the {} of the wall", file.string(), displacement_mm.size(),
        rest.vertices.size());
  TriangleMesh moved;
  moved.vertices = rest.vertices;
  moved.triangles = rest.triangles;
  for (std::size_t v = 0; v < moved.vertices.size(); ++v) moved.vertices[v] += displacement_mm[v];
  return moved;
}

Truth Truth::open(const std::filesystem::path& dataset) {
  Truth truth;
  truth.layout_.root = dataset;
  const DatasetLayout& layout = truth.layout_;
  check(std::filesystem::is_directory(dataset), "{}: no such folder", dataset.string());
  check(std::filesystem::exists(layout.info()), "{}: not a dataset (no dataset.json)",
        dataset.string());
  check(std::filesystem::exists(layout.manifest()),
        "{}: the dataset was not finished (no manifest.sha256); run the simulation again",
        dataset.string());
  truth.labels_ = read_info(layout.info()).truth.labels;
  truth.camera_ = load_camera(layout.camera().string());
  truth.track_ = read_tum(layout.trajectory());
  truth.wall_ = read_ply(layout.wall());
  return truth;
}

cv::Mat Truth::label(const std::string& name, int index) const {
  const LabelImage& label = label_image(name);
  const auto file = label.file(layout_, index);
  const cv::Mat image = label.read(file);
  check(image.cols == camera_.lens.width && image.rows == camera_.lens.height &&
            image.type() == label.type,
        "{}: {} x {} px of {}, expected {} x {} of {}", file.string(), image.cols, image.rows,
        cv::typeToString(image.type()), camera_.lens.width, camera_.lens.height,
        cv::typeToString(label.type));
  return image;
}

bool Truth::wall_moves() const { return std::filesystem::exists(layout_.wall_motion(0)); }

TriangleMesh Truth::wall(int index) const {
  const auto file = layout_.wall_motion(index);
  if (!std::filesystem::exists(file)) return wall_;
  return moved_wall(wall_, file);
}

RowPoses Truth::row_poses(int index) const {
  const auto file = layout_.row_poses(index);
  if (std::filesystem::exists(file)) return read_row_poses(file, camera_);
  return RowPoses(track_[static_cast<std::size_t>(index)].world_from_camera);
}

}  // namespace rugae
