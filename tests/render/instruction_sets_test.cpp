// Every instruction set gives the same bytes. Single precision rounds differently in each, which
// shows where a ray passes an outline, an edge or a corner within that rounding: about one ray in a
// million. So besides ordinary frames there are rays and frames in which nearly every ray does.

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <map>
#include <opencv2/core.hpp>
#include <set>

#include "core/check.h"
#include "core/files.h"
#include "core/random.h"
#include "render/frame.h"
#include "render/simulate.h"
#include "tests/render/walls.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;
using test::folded_mesh;

// Those that this processor has. The first is there on every one.
std::vector<std::string> instruction_sets() {
  std::vector<std::string> found;
  for (const char* isa : {"isa=sse2", "isa=sse4.2", "isa=avx", "isa=avx2", "isa=avx512"}) try {
      Raycaster(test::plane_mesh(1.0, 1.0, 1), isa);
      found.emplace_back(isa);
    } catch (const Error&) {
    }
  return found;
}

bool same(const Hit& a, const Hit& b) {
  return a.triangle == b.triangle && a.range_mm == b.range_mm && a.b1 == b.b1 && a.b2 == b.b2;
}

// Rays that pass outlines on either side, 1e-9 to 1e-5 rad beside them, and straight at them.
std::vector<Vec3> rays_at_outlines(const TriangleMesh& mesh, const Vec3& eye) {
  std::vector<Vec3> rays;
  const auto across = edge_neighbours(mesh);
  std::uint32_t draw = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const auto other = static_cast<std::size_t>(across[t][k]);
      const Vec3 a = mesh.vertices[mesh.triangles[t][k]],
                 b = mesh.vertices[mesh.triangles[t][(k + 1) % 3]];
      const bool towards = triangle_normal(mesh, t).dot(a - eye) > 0.0,
                 beyond = triangle_normal(mesh, other).dot(a - eye) > 0.0;
      if (other < t || towards == beyond) continue;
      for (int repeat = 0; repeat < 8; ++repeat) {
        const auto u = random_uniform(3, Purpose::test, 1, draw++);
        const Vec3 at = repeat < 2 ? a : Vec3(a + u[0] * (b - a));
        const Vec3 straight = (at - eye).normalized();
        const double beside_rad =
            repeat % 2 == 0 ? 0.0 : (u[1] < 0.5 ? 1.0 : -1.0) * std::pow(10.0, -9.0 + 4.0 * u[2]);
        rays.push_back((straight + beside_rad * straight.cross(b - a).normalized()).normalized());
      }
    }
  return rays;
}

TEST(InstructionSets, HitsAtOutlinesAreThoseOfTheExactRay) {
  const TriangleMesh mesh = folded_mesh(5);
  const Vec3 eye(16.0, 0.0, 2.0);  // between folds
  const auto rays = rays_at_outlines(mesh, eye);
  ASSERT_GT(rays.size(), 3000u);
  std::vector<Hit> reference;
  for (const std::string& isa : instruction_sets()) {
    std::vector<Hit> hits(rays.size());
    Raycaster(mesh, isa).intersect(eye, rays, hits);
    if (reference.empty()) reference = hits;
    int different = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) different += !same(hits[i], reference[i]);
    EXPECT_EQ(different, 0) << isa;
  }
  // Where an outline is passed by more than double precision can tell, the answer is known.
  int wrong = 0, compared = 0;
  for (std::size_t i = 1; i < rays.size(); i += 6, ++compared) {
    const auto expected = test::brute_force(mesh, eye, rays[i]);
    ASSERT_TRUE(expected);
    wrong += std::abs(reference[i].range_mm - expected->range_mm) > 1e-3;
  }
  EXPECT_EQ(wrong, 0) << "of " << compared;
}

// Points on rays that pass outlines: what hides them is nearer by millimetres or not there at all.
TEST(InstructionSets, PointsBehindOutlinesAreHiddenFromAllAlike) {
  const TriangleMesh mesh = folded_mesh(5);
  const Vec3 eye(16.0, 0.0, 2.0);  // between folds
  std::vector<Vec3> points;
  for (const Vec3& ray : rays_at_outlines(mesh, eye)) points.push_back(eye + 14.0 * ray);
  std::vector<std::uint8_t> wanted(points.size(), 1), reference;
  for (const std::string& isa : instruction_sets()) {
    std::vector<std::uint8_t> hidden(points.size());
    Raycaster(mesh, isa).hidden_from(eye, points, wanted, hidden);
    if (reference.empty()) reference = hidden;
    int different = 0;
    for (std::size_t i = 0; i < points.size(); ++i) different += hidden[i] != reference[i];
    EXPECT_EQ(different, 0) << isa;
  }
  int wrong = 0, compared = 0;
  std::set<int> answers;
  for (std::size_t i = 1; i < points.size(); i += 6, ++compared) {
    const Vec3 to = points[i] - eye;
    const auto nearest = test::brute_force(mesh, eye, to);  // in shares of the way
    const bool expected = nearest && nearest->range_mm < Raycaster::kReach;
    wrong += expected != (reference[i] != 0);
    answers.insert(expected);
  }
  EXPECT_EQ(wrong, 0) << "of " << compared;
  EXPECT_EQ(answers.size(), 2u);
}

bool same_bytes(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() &&
         (a.empty() || std::memcmp(a.data, b.data, a.total() * a.elemSize()) == 0);
}

void expect_same(const CleanFrame& a, const CleanFrame& b, const std::string& what) {
  EXPECT_TRUE(same_bytes(a.radiance, b.radiance)) << "radiance " << what;
  for (const LabelImage& label : label_images())
    EXPECT_TRUE(same_bytes(a.truth.*label.image, b.truth.*label.image)) << label.name << what;
}

Camera camera_with_lights() {
  Camera camera = test::small_camera(96, 72);
  camera.lights = {{Vec3(1.5, 0.2, 0.0), Vec3::UnitZ(), 0.0, 0.6},
                   {Vec3(-1.4, -0.3, 0.0), Vec3(0.1, 0.0, 1.0).normalized(), 2.0, 0.6}};
  return camera;
}

// A wall with overhanging folds of which every vertex lies on the ray of a pixel's centre, so that
// nearly every ray goes through a corner, and many along outlines.
TriangleMesh wall_on_the_rays(const RayTable& rays, const Rigid3& pose) {
  constexpr int kFold = 12, kOverhang = 4;  // columns
  const Mat3 rotation = pose.rotation.toRotationMatrix();
  std::vector<std::pair<int, double>> columns;  // and how far the wall is there
  for (int x = 0; x < rays.width; ++x) {
    columns.emplace_back(x, 22.0 - 2.0 * (x % kFold) / kFold);
    if (x % kFold != kFold - 1) continue;
    for (int back = 1; back <= kOverhang; ++back) columns.emplace_back(x - back, 20.0 + back);
    for (int on = kOverhang - 1; on >= 0; --on) columns.emplace_back(x - on, 26.0 - 0.5 * on);
  }
  TriangleMesh mesh;
  const int across = static_cast<int>(columns.size());
  for (int y = 0; y < rays.height; ++y)
    for (const auto& [x, range_mm] : columns) {
      const Vec3 ray = rotation * rays.directions_cam[static_cast<std::size_t>(y * rays.width + x)];
      mesh.vertices.push_back(pose.translation +
                              (range_mm + 0.4 * std::sin(0.9 * y + 0.3 * x)) * ray);
    }
  for (int y = 0; y + 1 < rays.height; ++y)
    for (int s = 0; s + 1 < across; ++s) {
      const int a = y * across + s, b = a + 1, c = a + across, d = c + 1;
      mesh.triangles.emplace_back(a, b, c);
      mesh.triangles.emplace_back(b, d, c);
    }
  mesh.normals = angle_weighted_normals(mesh);
  return mesh;
}

TEST(InstructionSets, FramesWhoseRaysGoThroughCornersAreTheSame) {
  const Camera camera = camera_with_lights();
  const Rigid3 pose(test::random_rotation(3), Vec3(0.3, -0.7, 1.1));
  const TriangleMesh mesh = wall_on_the_rays(make_ray_table(camera.lens, camera.vignetting), pose);
  Rigid3 later = pose;
  later.translation += pose.rotation * Vec3(-1.5, 0.3, 0.2);
  FrameView now, previous, next;
  now.camera = previous.camera = RowPoses(pose);
  next.camera = RowPoses(later);
  std::optional<CleanFrame> reference;
  for (const std::string& isa : instruction_sets()) {
    const FrameRenderer renderer(Surface(mesh, test::constant_material(test::lambert(0.5f))),
                                 camera,
                                 {.labels = LabelSet::all(),
                                  .paths = {.bounces = 2, .samples = 2, .seed = 3},
                                  .device = isa});
    CleanFrame frame = renderer.render(now, &previous, &next);
    if (reference)
      expect_same(frame, *reference, isa);
    else
      reference = std::move(frame);
  }
  // or the test shows nothing
  EXPECT_GT(cv::countNonZero(reference->truth.masks & kMaskValid), 96 * 72 / 2);
  EXPECT_GT(cv::countNonZero(reference->truth.masks & kMaskFlowOccluded), 50);
}

// A moving wall, rolling shutter, lights beside the camera, light from other walls, every label.
TEST(InstructionSets, DatasetsAreTheSame) {
  const fs::path root = fs::temp_directory_path() / fmt::format("rugae_isa_{}", getpid());
  fs::remove_all(root);
  make_folder(root);
  write_atomic(root / "camera.yaml",
               "name: lit\nframes_in_paper: 6\ndiameter_mm: 4\n"
               "lens: {model: brown_conrady, width: 128, height: 96, horizontal_fov_deg: 90, "
               "k1: -0.05}\n"
               "sensor: {pixel_pitch_um: 3, fps: 30, bit_depth: 10, full_well_e: 9000, "
               "read_noise_e: 5, shutter: rolling, row_time_us: 300}\n"
               "lights:\n"
               "  - {offset_mm: [1.5, 0.2, 0], intensity: 0.6}\n"
               "  - {offset_mm: [-1.4, -0.3, 0], intensity: 0.6, lobe: 2}\n");
  SimulateOptions options;
  options.scene = "stomach-moving";
  options.camera = (root / "camera.yaml").string();
  options.trajectory = "1";
  options.resolution = "coarse";
  options.frames = 3;
  options.render.light.bounces = 2;
  options.render.light.samples = 2;
  options.render.truth = {.labels = LabelSet::all(), .tracks = 40, .coverage = true};
  options.render.output.radiance = true;
  const auto contents = [&](const fs::path& folder) {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
      if (entry.is_regular_file())
        files[fs::relative(entry.path(), folder).string()] = read_text(entry.path());
    return files;
  };
  std::map<std::string, std::string> reference;
  for (const std::string& isa : instruction_sets()) {
    if (isa == "isa=sse2" || isa == "isa=avx") continue;  // the ends and what most processors have
    options.ray_device = isa;
    Progress progress(Progress::Output::silent);
    simulate(options, root / isa, progress);
    auto files = contents(root / isa);
    if (reference.empty())
      reference = std::move(files);
    else
      for (const auto& [file, bytes] : reference)
        EXPECT_TRUE(files.contains(file) && files.at(file) == bytes) << isa << ' ' << file;
  }
  for (const char* folder : {"truth/backward_flow", "truth/triangles", "truth/row_poses",
                             "truth/wall_motion", "truth/tracks", "truth/radiance"})
    EXPECT_TRUE(std::ranges::any_of(reference, [&](const auto& file) {
      return file.first.starts_with(folder);
    })) << folder;
  fs::remove_all(root);
}

}  // namespace
}  // namespace rugae
