#include "studies/packed.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "tests/studies/from_base64.h"
#include "tests/validate/shapes.h"

namespace rugae {
namespace {

template <typename T>
std::vector<T> array_of(const std::string& text) {
  const std::vector<unsigned char> bytes = from_base64(text);
  std::vector<T> out(bytes.size() / sizeof(T));
  std::memcpy(out.data(), bytes.data(), out.size() * sizeof(T));
  return out;
}

TEST(Packed, FloatsKeepTheirValuesAndGaps) {
  const auto back = array_of<float>(packed::floats({0.5, std::nan(""), -3.25}));
  ASSERT_EQ(back.size(), 3u);
  EXPECT_EQ(back[0], 0.5f);
  EXPECT_TRUE(std::isnan(back[1]));
  EXPECT_EQ(back[2], -3.25f);
}

TEST(Packed, PointsFollowEachOther) {
  EXPECT_EQ(array_of<float>(packed::points({Vec3(1, 2, 3), Vec3(4, 5, 6)})),
            (std::vector<float>{1, 2, 3, 4, 5, 6}));
}

TEST(Packed, SharesEndAtTheTop) {
  EXPECT_EQ(array_of<unsigned char>(packed::shares({0.0, 1.0, 2.0, 9.0}, 2.0)),
            (std::vector<unsigned char>{0, 128, 255, 255}));
}

TEST(Packed, MeshIsWithinHalfAStep) {
  TriangleMesh mesh = shapes::sphere(40.0, 12);
  for (Vec3& v : mesh.vertices) v = Vec3(v.x() + 7.0, 2.0 * v.y(), v.z());
  const nlohmann::json json = packed::mesh(mesh);
  EXPECT_FALSE(json.at("wide").get<bool>());
  const auto numbers = array_of<std::uint16_t>(json.at("points"));
  ASSERT_EQ(numbers.size(), 3 * mesh.vertices.size());
  const double step_mm = json.at("step_mm");
  EXPECT_NEAR(step_mm, 160.0 / 65535.0, 1e-12);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const double back = json.at("corner_mm")[i % 3].get<double>() + step_mm * numbers[i];
    ASSERT_NEAR(back, mesh.vertices[i / 3][static_cast<int>(i % 3)], 0.5001 * step_mm);
  }
  const auto corners = array_of<std::uint16_t>(json.at("triangles"));
  ASSERT_EQ(corners.size(), 3 * mesh.triangles.size());
  for (std::size_t i = 0; i < corners.size(); ++i)
    ASSERT_EQ(corners[i], mesh.triangles[i / 3][static_cast<int>(i % 3)]);
}

TEST(Packed, ManyVerticesNeedWideIndices) {
  TriangleMesh mesh;
  mesh.vertices.assign(70'000, Vec3(1, 2, 3));
  mesh.vertices[69'999] = Vec3(4, 5, 6);
  mesh.triangles = {Vec3i(0, 1, 69'999)};
  const nlohmann::json json = packed::mesh(mesh);
  EXPECT_TRUE(json.at("wide").get<bool>());
  EXPECT_EQ(array_of<std::uint32_t>(json.at("triangles")),
            (std::vector<std::uint32_t>{0, 1, 69'999}));
}

}  // namespace
}  // namespace rugae
