#include "dataset/ply_io.h"

#include <cmath>
#include <cstring>
#include <optional>
#include <sstream>
#include <string_view>

#include "core/check.h"
#include "core/files.h"

namespace rugae {
namespace {

struct Header {
  std::size_t vertices = 0, triangles = 0, size = 0;
  bool precise = false, normals = false, colors = false, sigma = false;
  std::size_t vertex_bytes() const {
    return 3 * (precise ? sizeof(double) : sizeof(float)) + (normals ? 3 * sizeof(float) : 0) +
           (colors ? 3 : 0) + (sigma ? sizeof(float) : 0);
  }
};
constexpr std::size_t kTriangleBytes = 1 + 3 * sizeof(std::int32_t);

// The lines of write_ply in their order; anything else is not ours.
std::optional<Header> parse_header(std::string_view bytes) {
  constexpr std::string_view kEnd = "\nend_header\n";
  const std::size_t end = bytes.find(kEnd);
  if (end == std::string_view::npos) return std::nullopt;
  std::istringstream lines{std::string(bytes.substr(0, end))};
  Header header;
  header.size = end + kEnd.size();
  std::string line, properties;
  bool binary = false;
  for (int number = 0; std::getline(lines, line); ++number) {
    std::istringstream words(line);
    std::string word, what;
    words >> word;
    if (number == 0 && word != "ply") return std::nullopt;
    if (line == "format binary_little_endian 1.0") binary = true;
    if (word == "element") {
      words >> what;
      words >> (what == "vertex" ? header.vertices : header.triangles);
      if (!words || (what != "vertex" && what != "face")) return std::nullopt;
    }
    if (word == "property") properties += line.substr(9) + ";";
  }
  const auto take = [&properties](std::string_view expected) {
    const bool present = properties.starts_with(expected);
    if (present) properties.erase(0, expected.size());
    return present;
  };
  header.precise = take("double x;double y;double z;");
  if (!header.precise && !take("float x;float y;float z;")) return std::nullopt;
  header.normals = take("float nx;float ny;float nz;");
  header.colors = take("uchar red;uchar green;uchar blue;");
  header.sigma = take("float sigma;");
  // Counts beyond the file's size would overflow the sums below.
  if (header.vertices > bytes.size() || header.triangles > bytes.size()) return std::nullopt;
  const bool faces = take("list uchar int vertex_indices;");
  if (!binary || !properties.empty() || (!faces && header.triangles > 0)) return std::nullopt;
  return header;
}

template <typename T>
T take(const char*& at) {
  T value;
  std::memcpy(&value, at, sizeof(T));
  at += sizeof(T);
  return value;
}

template <typename T, typename V>
V take3(const char*& at) {
  const T x = take<T>(at), y = take<T>(at), z = take<T>(at);
  return V(x, y, z);
}

}  // namespace

TriangleMesh read_ply(const std::filesystem::path& file) {
  const std::string bytes = read_text(file);
  const auto header = parse_header(bytes);
  check(header.has_value(), "{}: not a binary PLY of this program", file.string());
  const std::size_t expected = header->vertices * header->vertex_bytes() +
                               header->triangles * kTriangleBytes,
                    found = bytes.size() - header->size;
  check(found == expected, "{}: truncated or damaged: {} bytes of data, expected {}", file.string(),
        found, expected);
  TriangleMesh mesh;
  mesh.vertices.reserve(header->vertices);
  mesh.triangles.reserve(header->triangles);
  const char* at = bytes.data() + header->size;
  for (std::size_t v = 0; v < header->vertices; ++v) {
    mesh.vertices.push_back(header->precise ? take3<double, Vec3>(at) : take3<float, Vec3>(at));
    check(mesh.vertices.back().allFinite(), "{}: vertex {} is not finite", file.string(), v);
    if (header->normals) mesh.normals.push_back(take3<float, Vec3f>(at));
    if (header->colors) mesh.colors.push_back(take3<unsigned char, Vec3f>(at) / 255.0f);
    if (header->sigma) {
      mesh.sigma.push_back(take<float>(at));
      check(std::isfinite(mesh.sigma.back()) && mesh.sigma.back() > 0.0f,
            "{}: vertex {} has sigma {}, expected above 0", file.string(), v, mesh.sigma.back());
    }
  }
  const auto last = static_cast<std::int64_t>(header->vertices) - 1;
  for (std::size_t t = 0; t < header->triangles; ++t) {
    const int corners = take<unsigned char>(at);
    const Vec3i triangle = take3<std::int32_t, Vec3i>(at);
    check(corners == 3 && triangle.minCoeff() >= 0 && triangle.maxCoeff() <= last,
          "{}: face {} is not a triangle of vertices 0 to {}", file.string(), t, last);
    mesh.triangles.push_back(triangle);
  }
  return mesh;
}

}  // namespace rugae
