#include "scenes/scene_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/check.h"
#include "core/like.h"
#include "core/portable_math.h"
#include "core/random.h"
#include "core/yaml.h"

namespace rugae {
namespace {

const std::vector<std::string> kKinds = {"procedural", "mesh", "chessboard"};
const std::vector<std::string> kWallNormals = {"auto", "outward", "inward"};
const std::vector<std::string> kOpenEnds = {"cap", "refuse"};

// Every section's keys, once: for reading, writing and listing.
template <typename Visitor>
void keys(Visitor& v, ReliefOptions& o) {
  v("rugae_height_mm", o.rugae_height_mm);
  v("rugae_thickness_mm", o.rugae_thickness_mm);
  v("rugae_spacing_mm", o.rugae_spacing_mm);
  v("areae_size_mm", o.areae_size_mm);
  v("areae_depth_mm", o.areae_depth_mm);
}
template <typename Visitor>
void keys(Visitor& v, MucosaOptions& o) {
  v("base_albedo", o.base_albedo);
  v("vessel_contrast", o.vessel_contrast);
  v("mottle_contrast", o.mottle_contrast);
  v("wetness", o.wetness);
  v("oil", o.oil);
}
struct Lesions {
  InstanceOptions& of;
};
template <typename Visitor>
void keys(Visitor& v, Lesions& o) {
  v("polyp", o.of.polyp);
  v("ulcer", o.of.ulcer);
  v("erosion", o.of.erosion);
  v("bleeding", o.of.bleeding);
  v("angiectasia", o.of.angiectasia);
}
struct Objects {
  InstanceOptions& of;
};
template <typename Visitor>
void keys(Visitor& v, Objects& o) {
  v("debris", o.of.debris);
  v("bubbles", o.of.bubbles);
  v("mucus", o.of.mucus);
}
template <typename Visitor>
void keys(Visitor& v, ChessboardOptions& o) {
  v("columns", o.columns);
  v("rows", o.rows);
  v("square_mm", o.square_mm);
  v("border_mm", o.border_mm);
  v("white", o.white);
  v("black", o.black);
  v("gloss", o.gloss);
}
struct Shape {
  StomachOptions& of;
};
template <typename Visitor>
void keys(Visitor& v, Shape& o) {
  v("scale", o.of.scale);
  v("variation", o.of.variation);
}

// Of an imported mesh; where the file lies is read apart.
template <typename Visitor>
void keys(Visitor& v, ImportOptions& o) {
  v("mm_per_unit", o.mm_per_unit);
  v.choice("wall_normals", kWallNormals, o.wall);
  v.choice("open_ends", kOpenEnds, o.open_ends);
  v("component", o.component);
  v("target_edge_mm", o.target_edge_mm);
  v("with_relief", o.with_relief);
}

// FNV-1a (Fowler, Noll, Vo): a number for a path such as "mucosa.wetness".
std::uint64_t path_number(const std::string& path) {
  std::uint64_t h = 0xcbf29ce484222325ull;
  for (const char c : path) h = (h ^ static_cast<unsigned char>(c)) * 0x100000001b3ull;
  return h;
}

// Reads values, and draws those that are given as distributions.
struct DrawingReader {
  YamlReader& yaml;
  std::string section;  // with its dot
  std::uint64_t seed;

  void operator()(const char* key, Vec3& value) { yaml.get(key, value); }
  void operator()(const char* key, double& value) {
    if (yaml.has_mapping(key))
      value = drawn(key, false);
    else
      yaml.get(key, value);
  }
  void operator()(const char* key, int& value) {
    if (yaml.has_mapping(key))
      value = static_cast<int>(drawn(key, true));
    else
      yaml.get(key, value);
  }

 private:
  double drawn(const char* key, bool whole) {
    YamlReader of = *yaml.child(key);
    const std::string where = yaml.where(key);
    const int forms = of.has("uniform") + of.has("normal") + of.has("choice");
    Vec2 pair;
    std::vector<double> list;
    of.get("uniform", pair);
    of.get("normal", pair);
    of.get("choice", list);
    of.finish();
    check(forms == 1, "{}: {} has {} distributions, expected one of: uniform, normal, choice",
          where, key, forms);
    const std::uint64_t index = path_number(section + key);
    double value = 0.0;
    if (of.has("uniform")) {
      check(pair[0] <= pair[1], "{}: uniform is [{}, {}], expected the least value first",
            of.where("uniform"), pair[0], pair[1]);
      check(!whole || (pair[0] == std::floor(pair[0]) && pair[1] == std::floor(pair[1])),
            "{}: uniform is [{}, {}], but {} is a whole number", of.where("uniform"), pair[0],
            pair[1], key);
      const double u = random_uniform(seed, Purpose::scene_draw, 1, index)[0];
      value = pair[0] + u * (pair[1] - pair[0] + (whole ? 1.0 : 0.0));
      if (whole) value = std::min(std::floor(value), pair[1]);
    } else if (of.has("normal")) {
      check(pair[1] >= 0.0, "{}: normal is [{}, {}], expected a deviation of at least 0",
            of.where("normal"), pair[0], pair[1]);
      // Box and Muller, until it lies within two deviations
      double z = 3.0;
      for (std::uint32_t attempt = 1; std::abs(z) > 2.0; ++attempt) {
        const auto u = random_uniform(seed, Purpose::scene_draw, attempt, index);
        z = std::sqrt(-2.0 * portable_log(u[0])) * portable_turn(u[1]).cosine;
      }
      value = pair[0] + z * pair[1];
      if (whole) value = std::max(0.0, std::floor(value + 0.5));
    } else {
      check(!list.empty(), "{}: choice is empty, expected at least one value", of.where("choice"));
      const double u = random_uniform(seed, Purpose::scene_draw, 1, index)[0];
      value = list[std::min(list.size() - 1,
                            static_cast<std::size_t>(u * static_cast<double>(list.size())))];
      check(!whole || value == std::floor(value), "{}: {} is {}, expected a whole number",
            of.where("choice"), key, value);
    }
    constexpr double kMostWhole = std::numeric_limits<int>::max();
    check(!whole || std::abs(value) <= kMostWhole, "{}: {} is {}, beyond the whole numbers", where,
          key, value);
    return value;
  }
};

// Reads values and nothing else.
struct PlainReader {
  YamlReader& yaml;
  template <typename Value>
  void operator()(const char* key, Value& value) {
    yaml.get(key, value);
  }
  template <typename Enum>
  void choice(const char* key, const std::vector<std::string>& names, Enum& value) {
    int index = static_cast<int>(value);
    yaml.get_choice(key, names, index);
    value = static_cast<Enum>(index);
  }
};

struct Writer {
  std::string text, indent;
  void operator()(const char* key, const Vec3& v) {
    text += fmt::format("{}{}: [{}, {}, {}]\n", indent, key, v.x(), v.y(), v.z());
  }
  template <typename Number>
  void operator()(const char* key, const Number& value) {
    text += fmt::format("{}{}: {}\n", indent, key, value);
  }
  template <typename Enum>
  void choice(const char* key, const std::vector<std::string>& names, const Enum& value) {
    (*this)(key, names[static_cast<std::size_t>(value)]);
  }
  template <typename Section>
  void section(const char* name, Section section) {
    text += fmt::format("{}:\n", name);
    indent = "  ";
    keys(*this, section);
    indent.clear();
  }
};

struct Lister {
  std::vector<std::string> list;
  std::string section;  // with its dot
  template <typename Value>
  void operator()(const char* key, Value&) {
    list.push_back(section + key);
  }
  template <typename Enum>
  void choice(const char* key, const std::vector<std::string>&, Enum&) {
    list.push_back(section + key);
  }
  template <typename Section>
  void of(const char* name, Section options) {
    section = *name ? std::string(name) + "." : "";
    keys(*this, options);
  }
};

std::string quoted(const std::string& text) { return nlohmann::json(text).dump(); }

template <typename Section>
void read_section(YamlReader& yaml, const char* name, std::uint64_t seed, Section section) {
  auto child = yaml.child(name);
  if (!child) return;
  DrawingReader reader{*child, std::string(name) + ".", seed};
  keys(reader, section);
  child->finish();
}

void read_import(YamlReader& yaml, SceneFile& scene, const std::filesystem::path& file) {
  std::string mesh;
  if (scene.mesh.empty())
    yaml.require("mesh", mesh);
  else
    yaml.get("mesh", mesh);
  if (!mesh.empty()) scene.mesh = file.parent_path() / mesh;  // an absolute path stays itself
  PlainReader reader{yaml};
  keys(reader, scene.import);
  scene.import.check(file.string());
}

// What the file says, over what `scene` holds.
void read_over(SceneFile& scene, YamlReader& yaml, const std::filesystem::path& file,
               std::uint64_t seed) {
  int kind = static_cast<int>(scene.kind);
  yaml.get_choice("kind", kKinds, kind);
  scene.kind = static_cast<SceneKind>(kind);
  if (scene.kind == SceneKind::chessboard) {
    read_section<ChessboardOptions&>(yaml, "board", seed, scene.board);
    scene.board.check(file.string() + ": board");
    return yaml.finish();
  }
  if (scene.kind == SceneKind::mesh) {
    read_import(yaml, scene, file);
    for (const char* key : {"lesions", "objects"})
      check(!yaml.has(key), "{}: {} need a stomach of kind procedural", yaml.where(key), key);
  } else {
    DrawingReader reader{yaml, "", seed};
    Shape shape{scene.stomach};
    keys(reader, shape);
    read_section(yaml, "lesions", seed, Lesions{scene.stomach.instances});
    read_section(yaml, "objects", seed, Objects{scene.stomach.instances});
  }
  read_section<ReliefOptions&>(yaml, "relief", seed, scene.stomach.relief);
  scene.import.relief = scene.stomach.relief;
  scene.stomach.relief.check(file.string() + ": relief");
  read_section<MucosaOptions&>(yaml, "mucosa", seed, scene.mucosa);
  scene.mucosa.check(file.string() + ": mucosa");
  if (auto deformation = yaml.child("deformation")) {
    read_deformation(*deformation, scene.deformation);
    scene.deformation.check(file.string() + ": deformation");
  }
  yaml.finish();
  scene.stomach.check(file.string());
}

}  // namespace

SceneFile read_scene_file(const std::filesystem::path& file, std::uint64_t seed) {
  SceneFile scene;
  for (LikeFile& at : read_like_chain("scenes", "scene", file))
    read_over(scene, at.yaml, at.file, seed);
  return scene;
}

std::vector<std::string> list_scene_keys() {
  Lister lister{{"like", "kind", "mesh"}, ""};
  SceneFile any;
  lister.of<ImportOptions&>("", any.import);
  lister.of("", Shape{any.stomach});
  lister.of<ReliefOptions&>("relief", any.stomach.relief);
  lister.of<MucosaOptions&>("mucosa", any.mucosa);
  lister.of("lesions", Lesions{any.stomach.instances});
  lister.of("objects", Objects{any.stomach.instances});
  lister.of<ChessboardOptions&>("board", any.board);
  for (const Field& field : list_deformation()) lister.list.push_back("deformation." + field.path);
  return std::move(lister.list);
}

std::string resolved_yaml(const SceneFile& scene) {
  SceneFile all = scene;
  Writer writer;
  if (scene.kind == SceneKind::chessboard) {
    writer.text = "kind: chessboard\n";
    writer.section<ChessboardOptions&>("board", all.board);
    return writer.text;
  }
  if (scene.kind == SceneKind::mesh) {
    writer.text = fmt::format(
        "kind: mesh\nmesh: {}\n",
        quoted(std::filesystem::absolute(scene.mesh).lexically_normal().generic_string()));
    keys(writer, all.import);
  } else {
    writer.text = "kind: procedural\n";
    Shape shape{all.stomach};
    keys(writer, shape);
  }
  writer.section("relief", all.stomach.relief);
  writer.section("mucosa", all.mucosa);
  if (scene.kind == SceneKind::procedural) {
    writer.section("lesions", Lesions{all.stomach.instances});
    writer.section("objects", Objects{all.stomach.instances});
  }
  writer.text += "deformation: " + deformation_yaml(scene.deformation) + "\n";
  return writer.text;
}

}  // namespace rugae
