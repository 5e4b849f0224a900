#include "dataset/layout.h"

#include <fmt/format.h>

namespace rugae {
namespace {

std::string numbered(int index, const char* extension) {
  return fmt::format("{:06}{}", index, extension);
}

}  // namespace

std::filesystem::path DatasetLayout::frame(int index) const {
  return frames() / numbered(index, ".png");
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

}  // namespace rugae
