#include "dataset/truth.h"

#include "core/check.h"
#include "dataset/image_io.h"
#include "dataset/ply_io.h"

namespace rugae {
namespace {

cv::Mat of_size(cv::Mat image, int type, const Lens& lens, const std::filesystem::path& file) {
  check(image.cols == lens.width && image.rows == lens.height && image.type() == type,
        "{}: {} x {} px of {}, expected {} x {} of {}", file.string(), image.cols, image.rows,
        cv::typeToString(image.type()), lens.width, lens.height, cv::typeToString(type));
  return image;
}

}  // namespace

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
  truth.camera_ = load_camera(layout.camera().string());
  truth.track_ = read_tum(layout.trajectory());
  truth.wall_ = read_ply(layout.wall());
  return truth;
}

cv::Mat Truth::depth_mm(int index) const {
  const auto file = layout_.depth(index);
  return of_size(read_exr(file), CV_32FC1, camera_.lens, file);
}
cv::Mat Truth::normal(int index) const {
  const auto file = layout_.normals(index);
  return of_size(read_normals(file), CV_32FC3, camera_.lens, file);
}
cv::Mat Truth::flow_px(int index) const {
  const auto file = layout_.flow(index);
  return of_size(read_exr(file), CV_32FC2, camera_.lens, file);
}
cv::Mat Truth::masks(int index) const {
  const auto file = layout_.masks(index);
  return of_size(read_image_as_stored(file), CV_8UC1, camera_.lens, file);
}

}  // namespace rugae
