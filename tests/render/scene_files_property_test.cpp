// Scene files, of every key there is: sound ones are read, written and render, broken ones are
// refused with the file named.

#include <optional>
#include <set>

#include "core/mesh_io.h"
#include "scenes/scene_file.h"
#include "tests/render/input_files.h"
#include "tests/render/walls.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;
using test::check_frame;
using test::flip;
using test::one_of;
using test::real;
using test::text_of;
using test::whole;
using Kind = Field::Kind;

const std::vector<Field> kShape = {{"scale", Kind::real, 0.3, 2.0, {}},
                                   {"variation", Kind::real, 0.0, 1.0, {}}};
const std::vector<Field> kRelief = {{"rugae_height_mm", Kind::real, 0.0, 12.0, {}},
                                    {"rugae_thickness_mm", Kind::real, 1.0, 15.0, {}},
                                    {"rugae_spacing_mm", Kind::real, 3.0, 60.0, {}},
                                    {"areae_size_mm", Kind::real, 0.5, 10.0, {}},
                                    {"areae_depth_mm", Kind::real, 0.0, 1.0, {}}};
const std::vector<Field> kMucosa = {{"vessel_contrast", Kind::real, 0.0, 1.0, {}},
                                    {"mottle_contrast", Kind::real, 0.0, 1.0, {}},
                                    {"wetness", Kind::real, 0.0, 1.0, {}},
                                    {"oil", Kind::real, 0.0, 1.0, {}}};
const std::vector<Field> kLesions = {{"polyp", Kind::whole, 0, 30, {}},
                                     {"ulcer", Kind::whole, 0, 30, {}},
                                     {"erosion", Kind::whole, 0, 30, {}},
                                     {"bleeding", Kind::whole, 0, 30, {}},
                                     {"angiectasia", Kind::whole, 0, 30, {}}};
const std::vector<Field> kObjects = {{"debris", Kind::whole, 0, 30, {}},
                                     {"bubbles", Kind::whole, 0, 30, {}},
                                     {"mucus", Kind::real, 0.0, 0.2, {}}};
const std::vector<Field> kImport = {
    {"mm_per_unit", Kind::real, 0.001, 1000.0, {}},
    {"wall_normals", Kind::word, 0, 0, {"auto", "outward", "inward"}},
    {"open_ends", Kind::word, 0, 0, {"cap", "refuse"}},
    {"component", Kind::whole, 0, 1000, {}},
    {"target_edge_mm", Kind::real, 0.2, 10.0, {}},
    {"with_relief", Kind::flag, 0, 0, {}}};

const std::vector<Field> kBoard = {
    {"columns", Kind::whole, 3, 40, {}},       {"rows", Kind::whole, 3, 40, {}},
    {"square_mm", Kind::real, 0.1, 100.0, {}}, {"border_mm", Kind::real, 0.1, 100.0, {}},
    {"white", Kind::real, 0.5, 0.95, {}},      {"black", Kind::real, 0.0, 0.49, {}},
    {"gloss", Kind::real, 0.0, 1.0, {}}};

// A distribution all of whose draws lie within the field's range.
std::string distribution_of(const Field& field) {
  switch (whole(0, 2)) {
    case 0: {
      const std::string a = test::value_of(field), b = test::value_of(field);
      const bool ascending = std::stod(a) <= std::stod(b);
      return fmt::format("{{uniform: [{}, {}]}}", ascending ? a : b, ascending ? b : a);
    }
    case 1: {
      const double mean = real(field.low, field.high);
      const double deviation = 0.499 * std::min(mean - field.low, field.high - mean);
      return fmt::format("{{normal: [{}, {}]}}", text_of(mean), text_of(deviation));
    }
    default: {
      std::string text = "{choice: [";
      for (int n = whole(1, 4); n > 0; --n) text += test::value_of(field) + ", ";
      return text + "]}";
    }
  }
}

// What a random scene file may hold.
struct Allowed {
  bool distributions = true;  // in place of values
  bool renders = false;       // only what the mesh that is rendered bears, and soon
};

class SceneText {
 public:
  SceneText(SceneKind kind, const Allowed& allowed) : allowed_(allowed) {
    if (kind == SceneKind::chessboard) {
      if (flip()) section("board", kBoard);
      return;
    }
    if (kind == SceneKind::procedural) {
      some(kShape, true);
      if (flip()) section("lesions", kLesions);
      if (flip()) section("objects", kObjects);
    } else {
      some(allowed.renders ? rendered_import() : kImport, false);
    }
    if (flip()) section("relief", kRelief);
    if (flip()) {
      open("mucosa");
      some(kMucosa, true);
      if (flip()) add("base_albedo", fmt::format("[{}, {}, {}]", share(), share(), share()));
      text_ += "}, ";
    }
    if (flip()) {
      open("deformation");
      deformation();
      text_ += "}, ";
    }
  }
  void add(const std::string& key, const std::string& value) { text_ += key + ": " + value + ", "; }
  std::string str() const { return "{" + text_ + "}\n"; }

 private:
  static std::string share() { return text_of(real(0.001, 0.999)); }
  // The walls that are rendered are one closed piece of outward triangles.
  static std::vector<Field> rendered_import() {
    std::vector<Field> fields = kImport;
    for (Field& field : fields) {
      if (field.path == "wall_normals") field.words.pop_back();
      if (field.path == "component") field.high = 0.0;
      if (field.path == "target_edge_mm") field.low = 2.0;
    }
    return fields;
  }
  void open(const char* name) { text_ += std::string(name) + ": {"; }
  void some(const std::vector<Field>& fields, bool drawn) {
    for (const Field& field : fields) {
      if (!flip()) continue;
      const bool distributed = drawn && allowed_.distributions && whole(0, 3) == 0;
      add(field.path, distributed ? distribution_of(field) : test::value_of(field));
    }
  }
  void section(const char* name, const std::vector<Field>& fields) {
    open(name);
    some(fields, true);
    text_ += "}, ";
  }
  // Waves far enough apart for their width: the three keys of it together.
  void deformation() {
    const bool waves = flip();
    constexpr double kApart = 2.21;  // of the widths; 2.2017 is asked for
    for (const Field& field : list_deformation()) {
      const bool of_waves = field.path == "width_mm" || field.path == "speed_mm_s" ||
                            field.path == "waves_per_minute";
      if (!of_waves && flip()) add(field.path, test::value_of(field));
    }
    if (!waves) return;
    const double width = real(5.0, 100.0);
    const double a_minute = real(0.5, std::min(12.0, 20.0 * 60.0 / (kApart * width)));
    add("width_mm", text_of(width));
    add("waves_per_minute", text_of(a_minute));
    add("speed_mm_s", text_of(real(std::max(0.2, kApart * width * a_minute / 60.0), 20.0)));
  }

  Allowed allowed_;
  std::string text_;
};

void collect_keys(const YAML::Node& node, const std::string& section, std::set<std::string>& keys) {
  for (const auto& entry : node) {
    const std::string key = section + entry.first.Scalar();
    keys.insert(key);
    if (entry.second.IsMap()) collect_keys(entry.second, key + ".", keys);
  }
}

const char* name_of(SceneKind kind) {
  switch (kind) {
    case SceneKind::procedural:
      return "procedural";
    case SceneKind::mesh:
      return "mesh";
    case SceneKind::chessboard:
      return "chessboard";
  }
  return "";
}

class SceneFiles : public test::InputFiles {
 protected:
  SceneKind any_kind() const { return static_cast<SceneKind>(whole(0, 2)); }
  // A file of its own, or one that builds on a preset or on another file, of either kind.
  std::string random_scene(SceneKind kind, const Allowed& allowed, int depth = 0) {
    SceneText text(kind, allowed);
    std::optional<SceneKind> like;
    if (depth < 2 && whole(0, 2) == 0) {
      if (flip()) {
        const std::string preset = one_of(preset_names("scenes"));
        text.add("like", preset);
        like = preset == "chessboard" ? SceneKind::chessboard : SceneKind::procedural;
      } else {
        like = any_kind();
        const std::string name = fmt::format("like_{}.yaml", depth);
        file(random_scene(*like, allowed, depth + 1), name.c_str());
        text.add("like", name);
      }
    }
    const SceneKind inherited = like.value_or(SceneKind::procedural);
    if (kind != inherited || flip()) text.add("kind", name_of(kind));
    if (kind == SceneKind::mesh && (inherited != SceneKind::mesh || flip()))
      text.add("mesh", "wall.ply");
    const std::string written = text.str();
    collect_keys(YAML::Load(written), "", drawn_);
    return written;
  }

  std::set<std::string> drawn_;
};

TEST_F(SceneFiles, SoundOnesAreReadAndWritten) {
  test::for_cases(400, [&] {
    const std::string text = random_scene(any_kind(), {});
    RC_LOG(text);
    const std::string written = resolved_yaml(read_scene_file(file(text), 3));
    RC_ASSERT(resolved_yaml(read_scene_file(file(written), 3)) == written);
  });
  // A key that the reader knows and nobody draws is one that nobody tests.
  for (const std::string& key : list_scene_keys()) EXPECT_TRUE(drawn_.contains(key)) << key;
  for (const char* form : {"uniform", "normal", "choice"})
    for (const char* key : {"scale", "relief.rugae_height_mm", "mucosa.oil", "lesions.polyp"})
      EXPECT_TRUE(drawn_.contains(fmt::format("{}.{}", key, form))) << key << ' ' << form;
}

TEST_F(SceneFiles, AResolvedFileHoldsEveryKeyOfItsKind) {
  std::set<std::string> written;
  for (const char* text :
       {"{kind: procedural}", "{kind: mesh, mesh: wall.ply}", "{kind: chessboard}"})
    collect_keys(YAML::Load(resolved_yaml(read_scene_file(file(text), 1))), "", written);
  for (const std::string& key : list_scene_keys())
    EXPECT_TRUE(key == "like" || written.contains(key)) << key;
}

// A point well inside the wall.
Vec3 inside_of(const Scene& scene) {
  Vec3 sum = Vec3::Zero();
  int count = 0;
  for (std::size_t v = 0; v < scene.wall.vertices.size(); ++v)
    if (scene.regions[v] == Region::body || scene.regions[v] == Region::unknown) {
      sum += scene.wall.vertices[v];
      ++count;
    }
  return sum / count;
}

void check_motion(const Scene& scene) {
  std::vector<Vec3> moved;
  for (const double time_s : {0.0, 1.7, 1000.0}) {
    scene.motion(time_s, moved);
    RC_ASSERT(moved.size() == scene.wall.vertices.size());
    for (std::size_t v = 0; v < moved.size(); ++v)
      RC_ASSERT((moved[v] - scene.wall.vertices[v]).norm() <= scene.motion_reach_mm + 1e-9);
  }
}

TEST_F(SceneFiles, SoundOnesRender) {
  const Camera camera = test::small_camera(32, 24);
  const TriangleMesh wall =
      test::sphere_mesh(3, 40.0, [](const Vec3& d) { return 1.0 + 0.5 * d.z() * d.z(); });
  test::for_cases(8, [&] {
    const SceneKind kind = any_kind();
    const std::string text = random_scene(kind, {.distributions = true, .renders = true});
    RC_LOG(text);
    const std::string given = file(text);
    if (kind == SceneKind::mesh) {
      TriangleMesh in_units = wall;
      for (Vec3& v : in_units.vertices) v /= read_scene_file(given, 2).import.mm_per_unit;
      in_units.normals.clear();
      write_ply(root_ / "wall.ply", in_units, true);
    }
    std::optional<Scene> scene;
    std::string message;
    const auto load = [&] {
      scene.emplace(
          load_scene({.name_or_path = given, .seed = 2, .resolution = "coarse", .oil = 0.0}));
    };
    try {
      load();
    } catch (const Error& error) {  // many lesions on a small wall
      message = error.what();
    }
    RC_LOG(message);
    RC_ASSERT(scene || message.find("no room on the wall") != std::string::npos);
    if (!scene) return;
    if (scene->motion) check_motion(*scene);
    Rigid3 pose(test::random_rotation(4), inside_of(*scene));
    if (scene->board) pose = Rigid3(Quat::Identity(), inside_of(*scene) - Vec3(0.0, 0.0, 20.0));
    const Rigid3 next(pose.rotation, pose.translation + Vec3(0.3, 0.2, 0.1));
    check_frame(FrameRenderer(*scene, camera, {}).render(pose, &next));
  });
}

void read(const std::string& path) { read_scene_file(path, 1); }

TEST_F(SceneFiles, BrokenOnesAreRefused) {
  std::vector<std::string> sound = presets("scenes");
  for (const std::string& name : preset_names("scenes"))
    sound.push_back(resolved_yaml(read_scene_file(find_preset("scenes", "scene", name), 1)));
  expect_mistakes_refused(sound, read);
}

TEST_F(SceneFiles, BrokenRandomOnesAreRefused) {
  expect_mistakes_refused(
      [&] {
        // a value may stand in place of a distribution, so that is none of the mistakes
        const SceneKind kind = any_kind();
        SceneText text(kind, {.distributions = false, .renders = false});
        if (kind != SceneKind::procedural) text.add("kind", name_of(kind));
        if (kind == SceneKind::mesh) text.add("mesh", "wall.ply");
        return text.str();
      },
      read);
}

TEST_F(SceneFiles, BrokenDistributionsAreRefused) {
  const std::vector<std::string> broken = {
      "{}",
      "{zz: [1, 2]}",
      "{uniform: [1, 2], normal: [1, 0]}",
      "{uniform: [1, 2], zz: 1}",
      "{uniform: [2, 1]}",
      "{uniform: [1]}",
      "{uniform: [1, 2, 3]}",
      "{uniform: 1}",
      "{uniform: {a: 1}}",
      "{uniform: [1, .nan]}",
      "{uniform: [-.inf, 1]}",
      "{uniform: [one, two]}",
      "{normal: [1, -1]}",
      "{normal: [.nan, 1]}",
      "{normal: [1, .inf]}",
      "{normal: [1e300, 1]}",
      "{normal: ~}",
      "{choice: []}",
      "{choice: [.inf]}",
      "{choice: [banana]}",
      "{choice: [[1]]}",
      "{choice: [-1e300]}",
      "{choice: {a: 1}}",
      "{choice: ~}",
  };
  const auto refused = [&](const std::string& key, const std::string& distribution) {
    const std::size_t dot = key.find('.');
    const std::string text = dot == std::string::npos
                                 ? fmt::format("{{{}: {}}}", key, distribution)
                                 : fmt::format("{{{}: {{{}: {}}}}}", key.substr(0, dot),
                                               key.substr(dot + 1), distribution);
    const std::string given = file(text);
    std::string message;
    EXPECT_TRUE(test::refuses([&] { read(given); }, "given.yaml", message))
        << text << ": " << message;
  };
  for (const char* key : {"scale", "relief.areae_depth_mm", "mucosa.oil", "objects.mucus",
                          "lesions.polyp", "objects.debris"})
    for (const std::string& distribution : broken) refused(key, distribution);
  for (const char* fraction : {"{choice: [1.5]}", "{uniform: [0.2, 0.4]}"})
    refused("lesions.polyp", fraction);
  // Neither what cannot be drawn for a wall nor what is no number.
  for (const char* key : {"mm_per_unit", "component", "with_relief", "wall_normals"})
    refused(key, "{uniform: [1, 1]}");
}

}  // namespace
}  // namespace rugae
