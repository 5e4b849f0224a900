#include "dataset/layout.h"

#include <fmt/format.h>

namespace rugae {
namespace {

std::string numbered(int index, const char* extension) {
  return fmt::format("{:06}{}", index, extension);
}

}  // namespace

std::filesystem::path DatasetLayout::frame(int index) const {
  const std::filesystem::path jpeg = jpeg_frame(index);
  return std::filesystem::exists(jpeg) ? jpeg : png_frame(index);
}
std::filesystem::path DatasetLayout::png_frame(int index) const {
  return frames() / numbered(index, ".png");
}
std::filesystem::path DatasetLayout::jpeg_frame(int index) const {
  return frames() / numbered(index, ".jpg");
}
std::filesystem::path DatasetLayout::adc(int index) const {
  return observations() / "adc" / numbered(index, ".png");
}
std::filesystem::path DatasetLayout::mosaic(int index) const {
  return observations() / "mosaic" / numbered(index, ".png");
}
std::filesystem::path DatasetLayout::radiance(int index) const {
  return truth() / "radiance" / numbered(index, ".exr");
}
std::filesystem::path DatasetLayout::clean(int index) const {
  return truth() / "clean" / numbered(index, ".png");
}
std::filesystem::path DatasetLayout::depth(int index) const {
  return truth() / "depth" / numbered(index, ".exr");
}
std::filesystem::path DatasetLayout::normals(int index) const {
  return truth() / "normals" / numbered(index, ".png");
}
std::filesystem::path DatasetLayout::flow(int index) const {
  return truth() / "flow" / numbered(index, ".exr");
}
std::filesystem::path DatasetLayout::masks(int index) const {
  return truth() / "masks" / numbered(index, ".png");
}
std::filesystem::path DatasetLayout::backward_flow(int index) const {
  return truth() / "backward_flow" / numbered(index, ".exr");
}
std::filesystem::path DatasetLayout::triangles(int index) const {
  return truth() / "triangles" / numbered(index, ".exr");
}
std::filesystem::path DatasetLayout::row_poses(int index) const {
  return truth() / "row_poses" / numbered(index, ".txt");
}
std::filesystem::path DatasetLayout::tracks(int index) const {
  return truth() / "tracks" / numbered(index, ".csv");
}
std::filesystem::path DatasetLayout::wall_motion(int index) const {
  return truth() / "wall_motion" / numbered(index, ".ply");
}

}  // namespace rugae
