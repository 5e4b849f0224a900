// glTF 2.0 through tinygltf; apart from mesh_io.cpp because its header is heavy.

#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_EXTERNAL_IMAGE
#include <tiny_gltf.h>

#include <algorithm>
#include <cstring>
#include <sstream>

#include "core/check.h"
#include "core/files.h"
#include "core/mesh_io.h"
#include "core/portable_math.h"

namespace rugae {
namespace {

constexpr double kMetresPerMm = 1e-3;

// Appends `count` bytes as a buffer view of its own and returns the view's index.
int add_view(tinygltf::Model& model, const void* data, std::size_t count, int target) {
  auto& bytes = model.buffers.front().data;
  tinygltf::BufferView view;
  view.buffer = 0;
  view.byteOffset = bytes.size();
  view.byteLength = count;
  view.target = target;
  const auto* raw = static_cast<const unsigned char*>(data);
  bytes.insert(bytes.end(), raw, raw + count);
  bytes.resize((bytes.size() + 3) / 4 * 4);  // accessors start at multiples of four
  model.bufferViews.push_back(view);
  return static_cast<int>(model.bufferViews.size()) - 1;
}

int add_accessor(tinygltf::Model& model, int view, int component, int type, std::size_t count) {
  tinygltf::Accessor accessor;
  accessor.bufferView = view;
  accessor.componentType = component;
  accessor.type = type;
  accessor.count = count;
  model.accessors.push_back(accessor);
  return static_cast<int>(model.accessors.size()) - 1;
}

int add_vectors(tinygltf::Model& model, const std::vector<Vec3f>& vectors) {
  static_assert(sizeof(Vec3f) == 3 * sizeof(float));
  const int view =
      add_view(model, vectors.data(), vectors.size() * sizeof(Vec3f), TINYGLTF_TARGET_ARRAY_BUFFER);
  return add_accessor(model, view, TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC3,
                      vectors.size());
}

int add_scalars(tinygltf::Model& model, const std::vector<float>& values) {
  const int view =
      add_view(model, values.data(), values.size() * sizeof(float), TINYGLTF_TARGET_ARRAY_BUFFER);
  return add_accessor(model, view, TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_SCALAR,
                      values.size());
}

// glTF vertex colours are linear.
float linear_from_srgb(float c) {
  if (c <= 0.04045f) return c / 12.92f;
  return static_cast<float>(portable_power(std::min((c + 0.055) / 1.055, 1.0), 2.4));
}

}  // namespace

void write_glb(const std::filesystem::path& file, const TriangleMesh& mesh) {
  check_mesh(mesh, file.string());
  tinygltf::Model model;
  model.asset.version = "2.0";
  model.asset.generator = "rugae";
  model.buffers.emplace_back();

  std::vector<Vec3f> positions;
  positions.reserve(mesh.vertices.size());
  for (const Vec3& v : mesh.vertices) positions.push_back((kMetresPerMm * v).cast<float>());
  const int position = add_vectors(model, positions);
  Vec3f low = positions.front(), high = low;
  for (const Vec3f& p : positions) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  model.accessors[position].minValues = {low.x(), low.y(), low.z()};
  model.accessors[position].maxValues = {high.x(), high.y(), high.z()};

  tinygltf::Primitive primitive;
  primitive.mode = TINYGLTF_MODE_TRIANGLES;
  primitive.attributes["POSITION"] = position;
  const auto normals =
      mesh.normals.size() == mesh.vertices.size() ? mesh.normals : angle_weighted_normals(mesh);
  primitive.attributes["NORMAL"] = add_vectors(model, normals);
  if (mesh.colors.size() == mesh.vertices.size()) {
    std::vector<Vec3f> linear(mesh.colors.size());
    for (std::size_t v = 0; v < linear.size(); ++v)
      linear[v] = mesh.colors[v].unaryExpr(&linear_from_srgb);
    primitive.attributes["COLOR_0"] = add_vectors(model, linear);
  }
  if (mesh.sigma.size() == mesh.vertices.size()) {
    std::vector<float> metres(mesh.sigma.size());
    for (std::size_t v = 0; v < metres.size(); ++v)
      metres[v] = static_cast<float>(kMetresPerMm) * mesh.sigma[v];
    primitive.attributes["_SIGMA"] = add_scalars(model, metres);
  }
  std::vector<std::uint32_t> indices;
  indices.reserve(3 * mesh.triangles.size());
  for (const Vec3i& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) indices.push_back(static_cast<std::uint32_t>(t[k]));
  const int view = add_view(model, indices.data(), indices.size() * sizeof(std::uint32_t),
                            TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);
  primitive.indices = add_accessor(model, view, TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT,
                                   TINYGLTF_TYPE_SCALAR, indices.size());

  tinygltf::Material material;
  material.doubleSided = true;  // a wall is looked at from inside and from outside
  material.pbrMetallicRoughness.metallicFactor = 0.0;
  material.pbrMetallicRoughness.roughnessFactor = 0.6;
  model.materials.push_back(material);
  primitive.material = 0;
  model.meshes.emplace_back();
  model.meshes.back().name = file.stem().string();
  model.meshes.back().primitives.push_back(primitive);
  model.nodes.emplace_back();
  model.nodes.back().mesh = 0;
  model.scenes.emplace_back();
  model.scenes.back().nodes = {0};
  model.defaultScene = 0;

  std::ostringstream stream;
  tinygltf::TinyGLTF writer;
  check(writer.WriteGltfSceneToStream(&model, stream, false, true), "{}: glTF cannot be written",
        file.string());
  write_atomic(file, stream.str());
}

}  // namespace rugae
