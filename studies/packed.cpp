#include "studies/packed.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "studies/html.h"

namespace rugae::packed {
namespace {

// x86-64 is little-endian, as are the machines that read the page.
template <typename T>
std::string text_of(const std::vector<T>& values) {
  std::vector<unsigned char> bytes(values.size() * sizeof(T));
  if (!bytes.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
  return html::base64(bytes);
}

constexpr double kSteps = 65535.0;  // of 16 bits

template <typename Index>
std::string indices(const TriangleMesh& mesh) {
  std::vector<Index> out;
  out.reserve(3 * mesh.triangles.size());
  for (const Vec3i& triangle : mesh.triangles)
    for (const int v : triangle) out.push_back(static_cast<Index>(v));
  return text_of(out);
}

}  // namespace

std::string floats(const std::vector<double>& values) {
  return text_of(std::vector<float>(values.begin(), values.end()));
}

std::string points(const std::vector<Vec3>& points_mm) {
  std::vector<float> out;
  out.reserve(3 * points_mm.size());
  for (const Vec3& p : points_mm)
    for (const double v : p) out.push_back(static_cast<float>(v));
  return text_of(out);
}

std::string shares(const std::vector<double>& values, double top) {
  std::vector<unsigned char> out;
  out.reserve(values.size());
  for (const double v : values)
    out.push_back(static_cast<unsigned char>(std::lround(255.0 * std::min(v / top, 1.0))));
  return text_of(out);
}

nlohmann::json mesh(const TriangleMesh& mesh) {
  const Eigen::AlignedBox3d box = bounding_box(mesh);
  const double step_mm = std::max(box.sizes().maxCoeff(), 1e-9) / kSteps;
  std::vector<std::uint16_t> numbers;
  numbers.reserve(3 * mesh.vertices.size());
  for (const Vec3& v : mesh.vertices)
    for (int k = 0; k < 3; ++k)
      numbers.push_back(static_cast<std::uint16_t>(std::lround((v[k] - box.min()[k]) / step_mm)));
  const bool wide = mesh.vertices.size() > 65536;
  return {{"corner_mm", {box.min().x(), box.min().y(), box.min().z()}},
          {"step_mm", step_mm},
          {"points", text_of(numbers)},
          {"wide", wide},
          {"triangles", wide ? indices<std::uint32_t>(mesh) : indices<std::uint16_t>(mesh)}};
}

}  // namespace rugae::packed
