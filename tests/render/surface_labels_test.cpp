// Labels of what the wall is there and of what the light is made of.

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <opencv2/core.hpp>

#include "render/frame.h"
#include "scenes/instances.h"
#include "tests/render/walls.h"

namespace rugae {
namespace {

using test::small_camera;

constexpr double kSingle = 1e-6;  // of float labels, relative

Vec3f at(const cv::Mat& image, int i) { return image.ptr<Vec3f>()[i]; }

Vec3 interpolated(const std::vector<Vec3>& values, const TriangleMesh& wall, const Vec3f& label) {
  const Vec3i& t = wall.triangles[static_cast<std::size_t>(label[0])];
  const double b1 = label[1], b2 = label[2];
  return (1.0 - b1 - b2) * values[t[0]] + b1 * values[t[1]] + b2 * values[t[2]];
}

TEST(SurfaceLabels, RangeAndShadingNormalOfACoarseSphere) {
  const Camera camera = small_camera();
  // Facets of two levels are large: the normals of facet and vertices differ by up to 10 degrees.
  const TriangleMesh wall = test::sphere_mesh(2, 20.0);
  const Rigid3 pose(test::random_rotation(4), Vec3(4.0, -3.0, 5.0));
  const FrameRenderer renderer(Surface(wall, test::constant_material(test::lambert(0.5f))), camera,
                               {.labels = LabelSet::all()});
  const FrameTruth truth = renderer.render(pose, nullptr).truth;
  std::vector<Vec3> radial;
  for (const Vec3& v : wall.vertices) radial.push_back(v.normalized());
  double widest_rad = 0.0;
  for (int y = 0; y < camera.lens.height; ++y)
    for (int x = 0; x < camera.lens.width; ++x) {
      const int i = y * camera.lens.width + x;
      const Vec3 ray = *camera.lens.unproject({x + 0.5, y + 0.5});
      const auto brute = test::brute_force(wall, pose.translation, pose.rotation * ray);
      ASSERT_TRUE(brute);
      ASSERT_NEAR(truth.range_mm.ptr<float>()[i], brute->range_mm, kSingle * brute->range_mm);
      ASSERT_NEAR(truth.depth_mm.ptr<float>()[i], brute->range_mm * ray.z(),
                  kSingle * brute->range_mm);
      // Vertex normals point out of the ball, those of labels to the camera inside.
      const Vec3 expected = -(pose.rotation.conjugate() *
                              interpolated(radial, wall, at(truth.triangle, i)).normalized());
      const Vec3 shading = at(truth.shading_normal, i).cast<double>();
      ASSERT_TRUE((shading - expected).norm() <= 10.0 * kSingle) << x << " " << y;
      const double cosine = shading.dot(at(truth.normal, i).cast<double>());
      widest_rad = std::max(widest_rad, std::acos(std::min(1.0, cosine)));
    }
  EXPECT_GT(widest_rad, 0.05);  // the two kinds of normals are two
}

TEST(SurfaceLabels, AlbedoRegionAndInstanceAreThoseOfThePoint) {
  const Scene scene =
      load_scene({.name_or_path = "stomach-lesions", .seed = 3, .resolution = "coarse"});
  // From a lesion's axis, so that one is in sight.
  ASSERT_FALSE(scene.instances->list().empty());
  const WallInstance& lesion = scene.instances->list().front();
  Camera camera = small_camera();
  camera.lens.k1 = 0.0;
  const Vec3 forward = -lesion.inward;
  Mat3 world_from_camera;
  world_from_camera.col(2) = forward;
  world_from_camera.col(0) = forward.unitOrthogonal();
  world_from_camera.col(1) = world_from_camera.col(2).cross(world_from_camera.col(0));
  const Rigid3 pose(Quat(world_from_camera), lesion.centre_mm + 12.0 * lesion.inward);
  const FrameRenderer renderer(scene, camera, {.labels = LabelSet::all()});
  const FrameTruth truth = renderer.render(pose, nullptr).truth;
  int on_lesions = 0, on_edges = 0;
  for (int i = 0; i < camera.lens.width * camera.lens.height; ++i) {
    if (!(truth.masks.ptr<unsigned char>()[i] & kMaskValid)) continue;
    const Vec3f label = at(truth.triangle, i);
    const Vec3 rest = interpolated(scene.rest_positions, scene.wall, label);
    const Vec3i& t = scene.wall.triangles[static_cast<std::size_t>(label[0])];
    const Vec3f corners(1.0f - label[1] - label[2], label[1], label[2]);
    int nearest = 0;
    corners.maxCoeff(&nearest);
    ASSERT_EQ(truth.region.ptr<unsigned char>()[i],
              static_cast<int>(scene.regions[static_cast<std::size_t>(t[nearest])]));
    const int instance = truth.instance.ptr<unsigned char>()[i];
    // A point on an outline, to the precision of the label, may fall either way.
    const Instances::Hit hit = scene.instances->at(rest);
    if (std::abs(hit.rho - 1.0) > 1e-4) {
      ASSERT_EQ(instance, scene.instance_at(rest.cast<float>()));
    } else {
      ++on_edges;
    }
    on_lesions += instance == lesion.id;
    const Vec3f albedo = at(truth.albedo, i);
    ASSERT_TRUE(albedo.minCoeff() > 0.0f && albedo.maxCoeff() < 1.0f);
  }
  EXPECT_GT(on_lesions, 50);
  EXPECT_LT(on_edges, 5);
  // The middle of the picture looks at the lesion's middle.
  const int middle = camera.lens.height / 2 * camera.lens.width + camera.lens.width / 2;
  EXPECT_EQ(truth.instance.ptr<unsigned char>()[middle], lesion.id);
}

// The wall is brighter and wetter to one side.
Vec3f graded_albedo(float x_mm) {
  return {0.6f + 0.3f * x_mm / 40.0f, 0.4f, 0.3f - 0.2f * x_mm / 40.0f};
}
Material graded() {
  return [](std::span<const MaterialQuery> queries, std::span<MucosaSample> samples) {
    for (std::size_t k = 0; k < queries.size(); ++k) {
      const float x = queries[k].rest_position_mm.x() / 40.0f;
      samples[k] = {};
      samples[k].albedo = graded_albedo(queries[k].rest_position_mm.x());
      samples[k].coverage = 0.5f + 0.4f * x;
    }
  };
}

TEST(SurfaceLabels, DirectAndIndirectLightAddUpToTheWhole) {
  Camera camera = small_camera();
  camera.lights.push_back({.offset_mm = {1.5, 0.0, 0.0}, .intensity = 0.7});
  const TriangleMesh wall = test::folded_mesh(3);
  const Rigid3 pose(test::random_rotation(6), Vec3(2.0, 1.0, -3.0));
  const auto render = [&](int bounces) {
    LabelSet labels;
    labels.diffuse = labels.specular = labels.indirect = true;
    labels.albedo = labels.triangles = true;
    return FrameRenderer(Surface(wall, graded()), camera,
                         {.labels = labels, .paths = {.bounces = bounces, .samples = 4}})
        .render(pose, nullptr);
  };
  const CleanFrame straight = render(0), bounced = render(2);
  double indirect_share = 0.0, specular_share = 0.0;
  const int pixels = camera.lens.width * camera.lens.height;
  for (int i = 0; i < pixels; ++i) {
    const FrameTruth& t = bounced.truth;
    const auto x = static_cast<float>(interpolated(wall.vertices, wall, at(t.triangle, i)).x());
    ASSERT_TRUE((at(t.albedo, i) - graded_albedo(x)).cwiseAbs().maxCoeff() <= kSingle) << i;
    const Vec3f whole = at(bounced.radiance, i);
    const Vec3f direct = at(t.diffuse, i) + Vec3f::Constant(t.specular.ptr<float>()[i]);
    const double bound = kSingle * whole.maxCoeff();
    ASSERT_TRUE((direct + at(t.indirect, i) - whole).cwiseAbs().maxCoeff() <= bound);
    // Light from other walls is what bounces add, and nothing else.
    ASSERT_TRUE((whole - at(straight.radiance, i) - at(t.indirect, i)).cwiseAbs().maxCoeff() <=
                bound);
    ASSERT_EQ(at(straight.truth.indirect, i), Vec3f::Zero().eval());
    ASSERT_EQ(at(straight.truth.diffuse, i), at(t.diffuse, i));
    indirect_share += at(t.indirect, i).mean() / std::max(1e-12f, whole.mean()) / pixels;
    specular_share += t.specular.ptr<float>()[i] > 0.0f ? 1.0 / pixels : 0.0;
  }
  EXPECT_GT(indirect_share, 0.05);
  EXPECT_GT(specular_share, 0.5);
}

TEST(SurfaceLabels, ALabelThatIsNotWantedIsNotMadeAndChangesNoOther) {
  const Camera camera = small_camera();
  const TriangleMesh wall = test::folded_mesh(3);
  const Rigid3 pose(test::random_rotation(6), Vec3(2.0, 1.0, -3.0));
  const Rigid3 next(pose.rotation, Vec3(2.5, 1.0, -3.2));
  const auto render = [&](const LabelSet& labels) {
    return FrameRenderer(Surface(wall, graded()), camera, {.labels = labels}).render(pose, &next);
  };
  const CleanFrame all = render(LabelSet::all());
  for (const LabelImage& label : label_images()) {
    LabelSet one = LabelSet::none();
    one.*label.wanted = true;
    const CleanFrame alone = render(one);
    EXPECT_EQ(cv::norm(alone.radiance, all.radiance, cv::NORM_INF), 0.0);
    for (const LabelImage& other : label_images()) {
      const cv::Mat& image = alone.truth.*other.image;
      if (other.wanted == &LabelSet::masks) continue;  // flow's bits come and go with flow
      EXPECT_EQ(image.empty(), other.wanted != label.wanted || (all.truth.*label.image).empty())
          << label.name << " " << other.name;
      if (image.empty()) continue;
      const cv::Mat& whole = all.truth.*other.image;
      EXPECT_EQ(std::memcmp(image.data, whole.data, image.total() * image.elemSize()), 0)
          << label.name;
    }
  }
}

}  // namespace
}  // namespace rugae
