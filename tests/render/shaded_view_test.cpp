#include "render/shaded_view.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "core/check.h"
#include "tests/render/walls.h"

namespace rugae {
namespace {

cv::Vec3b at(const cv::Mat& picture, int x, int y) { return picture.at<cv::Vec3b>(y, x); }

TEST(ShadedView, ASphereFillsThePictureAndDarkensToItsRim) {
  const TriangleMesh mesh = test::sphere_mesh(4, 10.0);
  const Lens lens = picture_lens(80, 60);
  const Rigid3 cam_from_world =
      view_of_box(bounding_box(mesh), Vec3(1.0, 2.0, 0.5), Vec3::UnitZ(), lens);
  const cv::Mat picture = shaded_view(mesh, cam_from_world, lens);
  ASSERT_EQ(picture.cols, 80);
  ASSERT_EQ(picture.rows, 60);
  EXPECT_EQ(at(picture, 0, 0), cv::Vec3b(255, 255, 255));
  EXPECT_NEAR(at(picture, 40, 30)[2], 255 * 0.80, 2.0);  // clay, head-on
  int x = 40;
  while (x < 80 && at(picture, x, 30) != cv::Vec3b(255, 255, 255)) ++x;
  EXPECT_GT(x, 55);
  EXPECT_LT(at(picture, x - 2, 30)[2], at(picture, 40, 30)[2] * 3 / 4);
}

TEST(ShadedView, AxesAreWhereTheyShouldBe) {
  // A red ball towards +x and a green one towards +z, seen from -y with z up.
  TriangleMesh mesh = test::sphere_mesh(3, 2.0);
  mesh.colors.assign(mesh.vertices.size(), Vec3f(1.0f, 0.0f, 0.0f));
  for (Vec3& v : mesh.vertices) v += Vec3(8.0, 0.0, 0.0);
  TriangleMesh green = test::sphere_mesh(3, 2.0);
  for (Vec3& v : green.vertices) v += Vec3(0.0, 0.0, 8.0);
  test::append(mesh, green);
  mesh.colors.resize(mesh.vertices.size(), Vec3f(0.0f, 1.0f, 0.0f));
  const Lens lens = picture_lens(100, 100);
  const Rigid3 pose = view_of_box(Eigen::AlignedBox3d(Vec3(-10, -10, -10), Vec3(10, 10, 10)),
                                  -Vec3::UnitY(), Vec3::UnitZ(), lens);
  const cv::Mat picture = shaded_view(mesh, pose, lens);
  const auto place = [&](const Vec3& p) { return *lens.project(pose * p); };
  const Vec2 red = place({8, -2, 0}), top = place({0, -2, 8});
  EXPECT_GT(red.x(), 60.0);
  EXPECT_LT(top.y(), 40.0);
  EXPECT_GT(at(picture, static_cast<int>(red.x()), static_cast<int>(red.y()))[2], 200);
  EXPECT_GT(at(picture, static_cast<int>(top.x()), static_cast<int>(top.y()))[1], 200);
}

TEST(ShadedView, LooksIntoAClosedOrgan) {
  TriangleMesh mesh = test::sphere_mesh(4, 10.0);
  for (const Vec3& v : mesh.vertices)  // the far half is blue
    mesh.colors.emplace_back(v.y() < 0.0 ? Vec3f(1.0f, 0.0f, 0.0f) : Vec3f(0.0f, 0.0f, 1.0f));
  const Lens lens = picture_lens(60, 60);
  const Rigid3 pose = view_of_box(bounding_box(mesh), -Vec3::UnitY(), Vec3::UnitZ(), lens);
  EXPECT_GT(at(shaded_view(mesh, pose, lens), 30, 30)[2], 200);
  EXPECT_GT(at(shaded_view(mesh, pose, lens, {.cull_front = true}), 30, 30)[0], 200);
}

// Two colourings of one trace are those of two meshes, and what a pixel lets through of its
// background is what covers it not.
TEST(ShadedView, ColouringsAreThoseOfMeshesAndTheRestIsBackground) {
  TriangleMesh mesh = test::sphere_mesh(3, 10.0);
  std::vector<std::vector<Vec3f>> colourings(2);  // the second: clay
  for (const Vec3& v : mesh.vertices)
    colourings[0].emplace_back((0.05 * v + Vec3::Constant(0.5)).cast<float>());
  const Lens lens = picture_lens(60, 50);
  const Rigid3 pose = view_of_box(bounding_box(mesh), -Vec3::UnitY(), Vec3::UnitZ(), lens);
  for (const bool cull_front : {false, true}) {
    ShadedViewOptions options;
    options.cull_front = cull_front;
    options.background_srgb = Vec3f::Zero();
    const auto views = coloured_views(mesh, colourings, pose, lens, options);
    ASSERT_EQ(views.size(), 2u);
    const double count = static_cast<double>(lens.width) * lens.height;
    const double covered = cv::sum(views[0].covered)[0] / count;
    EXPECT_GT(covered, 0.3);
    EXPECT_LT(covered, 0.9);
    for (std::size_t k = 0; k < views.size(); ++k) {
      mesh.colors = colourings[k];
      options.background_srgb = Vec3f::Zero();
      EXPECT_EQ(cv::norm(views[k].bgr, shaded_view(mesh, pose, lens, options), cv::NORM_INF), 0.0);
      options.background_srgb = Vec3f::Ones();
      const cv::Mat on_white = shaded_view(mesh, pose, lens, options);
      for (int y = 0; y < lens.height; ++y)
        for (int x = 0; x < lens.width; ++x)
          EXPECT_NEAR(at(on_white, x, y)[0] - at(views[k].bgr, x, y)[0],
                      255.0 * (1.0 - views[k].covered.at<float>(y, x)), 1.0)
              << x << ' ' << y;
    }
  }
  colourings[1].resize(3);
  EXPECT_THROW(coloured_views(mesh, colourings, pose, lens), Error);
}

TEST(ShadedView, UpMustNotRunAlongTheView) {
  EXPECT_THROW(view_of_box(Eigen::AlignedBox3d(Vec3(-1, -1, -1), Vec3(1, 1, 1)), Vec3::UnitZ(),
                           Vec3::UnitZ(), picture_lens(10, 10)),
               Error);
}

}  // namespace
}  // namespace rugae
