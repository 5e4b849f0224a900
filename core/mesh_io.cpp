#include "core/mesh_io.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <bit>
#include <cmath>
#include <map>

#include "core/check.h"
#include "core/files.h"

namespace rugae {
namespace {

static_assert(std::endian::native == std::endian::little, "PLY is written in memory order");

template <typename T>
void append(std::string& bytes, T value) {
  const auto* raw = reinterpret_cast<const char*>(&value);
  bytes.append(raw, sizeof(T));
}

unsigned char byte_of(float channel) {
  return static_cast<unsigned char>(std::lround(std::clamp(channel, 0.0f, 1.0f) * 255.0f));
}

void append_node(const aiScene& scene, const aiNode& node, const aiMatrix4x4& parent,
                 double mm_per_unit, const std::string& name, TriangleMesh& out) {
  const aiMatrix4x4 world = parent * node.mTransformation;
  for (unsigned m = 0; m < node.mNumMeshes; ++m) {
    const aiMesh& mesh = *scene.mMeshes[node.mMeshes[m]];
    const int base = static_cast<int>(out.vertices.size());
    for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
      const aiVector3D& stored = mesh.mVertices[v];
      check(std::isfinite(stored.x) && std::isfinite(stored.y) && std::isfinite(stored.z),
            "{}: vertex {} is not finite ({}, {}, {})", name, out.vertices.size(), stored.x,
            stored.y, stored.z);
      const aiVector3D p = world * stored;
      out.vertices.push_back(mm_per_unit * Vec3(p.x, p.y, p.z));
    }
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices != 3) continue;
      out.triangles.emplace_back(base + static_cast<int>(face.mIndices[0]),
                                 base + static_cast<int>(face.mIndices[1]),
                                 base + static_cast<int>(face.mIndices[2]));
    }
    if (mesh.HasVertexColors(0))
      for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
        const aiColor4D& c = mesh.mColors[0][v];
        out.colors.emplace_back(c.r, c.g, c.b);
      }
  }
  for (unsigned c = 0; c < node.mNumChildren; ++c)
    append_node(scene, *node.mChildren[c], world, mm_per_unit, name, out);
}

// Vertices at exactly the same place become one (files split them at seams of normals and texture);
// the first one's place in the order and colour stay. Assimp's own joining also takes what lies
// near, and would take NaN.
void join_vertices(TriangleMesh& mesh) {
  const auto less = [](const Vec3& a, const Vec3& b) {
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
  };
  std::map<Vec3, int, decltype(less)> places(less);
  std::vector<int> joined(mesh.vertices.size());
  int count = 0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const auto [it, fresh] = places.emplace(mesh.vertices[v], count);
    joined[v] = it->second;
    if (!fresh) continue;
    mesh.vertices[count] = mesh.vertices[v];
    if (!mesh.colors.empty()) mesh.colors[count] = mesh.colors[v];
    ++count;
  }
  mesh.vertices.resize(count);
  if (!mesh.colors.empty()) mesh.colors.resize(count);
  for (Vec3i& t : mesh.triangles) t = Vec3i(joined[t[0]], joined[t[1]], joined[t[2]]);
  std::erase_if(mesh.triangles,
                [](const Vec3i& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
}

}  // namespace

TriangleMesh read_mesh(const std::filesystem::path& file, double mm_per_unit) {
  const std::string name = file.string();
  check(mm_per_unit > 0.0 && std::isfinite(mm_per_unit), "{}: mm_per_unit is {}, expected above 0",
        name, mm_per_unit);
  check(std::filesystem::exists(file), "{}: no such mesh file", name);
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(name, aiProcess_Triangulate | aiProcess_SortByPType);
  if (!scene) {
    const std::string reason = importer.GetErrorString();
    // What assimp says of a readable file that holds vertices but no faces.
    if (reason.find("no meshes") != std::string::npos ||
        reason.find("NumMeshes") != std::string::npos)
      fail("{}: no triangles", name);
    fail("{}: not a mesh that can be read: {}", name, reason);
  }
  TriangleMesh mesh;
  if (scene->mRootNode)
    append_node(*scene, *scene->mRootNode, aiMatrix4x4(), mm_per_unit, name, mesh);
  if (mesh.colors.size() != mesh.vertices.size()) mesh.colors.clear();
  check_mesh(mesh, name);
  join_vertices(mesh);
  check_mesh(mesh, name);
  return mesh;
}

void write_ply(const std::filesystem::path& file, const TriangleMesh& mesh, bool precise,
               const std::string& unit) {
  const bool with_normals = mesh.normals.size() == mesh.vertices.size() && !mesh.normals.empty();
  const bool with_colors = mesh.colors.size() == mesh.vertices.size() && !mesh.colors.empty();
  const bool with_sigma = mesh.sigma.size() == mesh.vertices.size() && !mesh.sigma.empty();
  const char* real = precise ? "double" : "float";
  std::string bytes =
      fmt::format("ply\nformat binary_little_endian 1.0\ncomment lengths in {}\n", unit);
  bytes += fmt::format("element vertex {}\n", mesh.vertices.size());
  for (const char* axis : {"x", "y", "z"}) bytes += fmt::format("property {} {}\n", real, axis);
  if (with_normals) bytes += "property float nx\nproperty float ny\nproperty float nz\n";
  if (with_colors) bytes += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  if (with_sigma) bytes += "property float sigma\n";
  bytes += fmt::format("element face {}\nproperty list uchar int vertex_indices\nend_header\n",
                       mesh.triangles.size());
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    for (int k = 0; k < 3; ++k) {
      if (precise)
        append(bytes, mesh.vertices[v][k]);
      else
        append(bytes, static_cast<float>(mesh.vertices[v][k]));
    }
    if (with_normals)
      for (int k = 0; k < 3; ++k) append(bytes, mesh.normals[v][k]);
    if (with_colors)
      for (int k = 0; k < 3; ++k) append(bytes, byte_of(mesh.colors[v][k]));
    if (with_sigma) append(bytes, mesh.sigma[v]);
  }
  for (const Vec3i& triangle : mesh.triangles) {
    append(bytes, static_cast<unsigned char>(3));
    for (int k = 0; k < 3; ++k) append(bytes, static_cast<std::int32_t>(triangle[k]));
  }
  write_atomic(file, bytes);
}

}  // namespace rugae
