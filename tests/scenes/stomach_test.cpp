// The procedural stomach against what anatomy says of it.

#include "scenes/stomach.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "self_intersection.h"

namespace rugae {
namespace {

constexpr double kCoarseMm = 2.12, kMediumMm = 0.96;

const StomachWall& coarse() {
  static const StomachWall wall = make_stomach({}, 1, kCoarseMm);
  return wall;
}
const StomachWall& medium() {
  static const StomachWall wall = make_stomach({}, 1, kMediumMm);
  return wall;
}

double percentile(std::vector<double> values, double share) {
  const auto nth = values.begin() + static_cast<long>(share * (values.size() - 1));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

TEST(Stomach, IsOneClosedSurfaceWithoutSelfIntersection) {
  for (const StomachWall* wall : {&coarse(), &medium()}) {
    const EdgeReport edges = inspect_edges(wall->mesh);
    EXPECT_TRUE(edges.closed());
    EXPECT_EQ(edges.flipped, 0u);
    EXPECT_EQ(connected_components(wall->mesh).size(), 1u);
    // Euler: V - E + F = 2 for a sphere, with E = 3 F / 2
    EXPECT_EQ(wall->mesh.vertices.size() - wall->mesh.triangles.size() / 2, 2u);
    EXPECT_EQ(self_intersections(wall->mesh), 0);
  }
}

TEST(Stomach, TrianglesAreWellShaped) {
  std::vector<double> least_angle_deg;
  const TriangleMesh& mesh = medium().mesh;
  for (const Vec3i& t : mesh.triangles) {
    double least = 180.0;
    for (int k = 0; k < 3; ++k) {
      const Vec3 u = mesh.vertices[t[(k + 1) % 3]] - mesh.vertices[t[k]];
      const Vec3 v = mesh.vertices[t[(k + 2) % 3]] - mesh.vertices[t[k]];
      least = std::min(least, std::atan2(u.cross(v).norm(), u.dot(v)) * 180.0 / M_PI);
    }
    least_angle_deg.push_back(least);
  }
  // 20.7 degrees is Ruppert's bound for meshes of good quality; steep folds may stretch a few
  EXPECT_TRUE(percentile(least_angle_deg, 0.005) >= 20.7);
  EXPECT_TRUE(percentile(least_angle_deg, 0.0) >= 5.0);
}

TEST(Stomach, NormalsPointOutOfTheLumen) {
  const TriangleMesh& mesh = coarse().mesh;
  ASSERT_EQ(mesh.normals.size(), mesh.vertices.size());
  EXPECT_GT(signed_volume_mm3(mesh), 0.0);
  const ClosestPoint closest(mesh);
  for (std::size_t v = 0; v < mesh.vertices.size(); v += 97) {
    EXPECT_NEAR(mesh.normals[v].norm(), 1.0f, 1e-5f);
    const Vec3 n = mesh.normals[v].cast<double>();
    EXPECT_GT(closest.signed_distance_mm(mesh.vertices[v] + 0.3 * n), 0.0);
    EXPECT_LT(closest.signed_distance_mm(mesh.vertices[v] - 0.3 * n), 0.0);
  }
}

TEST(Stomach, HasTheSizeOfADistendedStomach) {
  constexpr double kMl = 1000.0;
  StomachOptions mean;
  mean.variation = 0.0;
  const StomachWall wall = make_stomach(mean, 1, kCoarseMm);
  EXPECT_NEAR(signed_volume_mm3(wall.mesh) / kMl, 1500.0, 75.0);  // about 1.5 l
  const StomachShape shape(mean, 1);
  EXPECT_GE(shape.length_mm(), 200.0);
  EXPECT_LE(shape.length_mm(), 300.0);
  const double longest = bounding_box(wall.mesh).sizes().maxCoeff();
  EXPECT_GE(longest, 200.0);
  EXPECT_LE(longest, 300.0);
  StomachOptions small = mean;
  small.scale = 0.5;
  EXPECT_NEAR(signed_volume_mm3(make_stomach(small, 1, 1.5).mesh) / kMl, 1500.0 / 8.0, 25.0);
}

// The height of the wall into the lumen above the smooth stomach, at a vertex, mm.
double height_at(const StomachShape& shape, const Vec3& vertex) {
  Vec3 gradient;
  const double distance = shape.distance_mm(vertex, &gradient);
  return -distance / gradient.norm();
}

TEST(Stomach, FoldsAreStrongOnTheGreaterCurvatureOfTheBodyAndFadeElsewhere) {
  const StomachShape shape({}, 1);
  const StomachWall& wall = medium();
  std::map<std::string, std::pair<double, int>> squares;
  for (std::size_t v = 0; v < wall.mesh.vertices.size(); ++v) {
    const Vec3& p = wall.mesh.vertices[v];
    const AxisPoint at = shape.locate(p);
    std::string zone;
    if (wall.regions[v] == Region::body && at.cos_greater > 0.6) zone = "greater";
    if (wall.regions[v] == Region::body && at.cos_greater < -0.9) zone = "lesser";
    if (wall.regions[v] == Region::antrum && at.s_mm > shape.fold_zone().fall_to_mm)
      zone = "antrum";
    if (wall.regions[v] == Region::fundus && at.cos_greater > 0.6) zone = "fundus";
    if (zone.empty()) continue;
    const double h = height_at(shape, p);
    squares[zone].first += h * h;
    ++squares[zone].second;
  }
  const auto rms = [&](const char* zone) {
    return std::sqrt(squares.at(zone).first / squares.at(zone).second);
  };
  RecordProperty("greater_rms_um", static_cast<int>(1000 * rms("greater")));
  EXPECT_GE(rms("greater"), 1.0);
  EXPECT_LE(rms("fundus"), 0.8 * rms("greater"));
  EXPECT_LE(rms("lesser"), 0.4 * rms("greater"));
  EXPECT_LE(rms("antrum"), 0.1 * rms("greater"));
}

TEST(Stomach, FoldsAreThreeToFiveMillimetresThick) {
  // Walk around the body over the greater curvature, and measure the mesh's height every 0.25 mm;
  // a fold is a stretch above half of its own crest, its thickness the length of that stretch.
  const StomachShape shape({}, 1);
  const ClosestPoint closest(medium().mesh);
  std::vector<double> thickness_mm, crest_mm;
  for (double level = -60.0; level <= 0.0; level += 4.0) {
    std::vector<double> height;
    Vec3 p(90.0, -30.0, level);  // from the front, around the left, to the back
    for (int step = 0; step < 400; ++step) {
      Vec3 n;
      for (int newton = 0; newton < 6; ++newton) {
        const double d = shape.distance_mm(p, &n);
        p -= d / n.squaredNorm() * n;
      }
      n.normalize();
      const AxisPoint at = shape.locate(p);
      if (at.cos_greater > 0.5) {
        // the mesh's height above p along -n, by bisection of inside and outside
        double low = -0.5, high = 7.0;
        for (int i = 0; i < 12; ++i) {
          const double mid = 0.5 * (low + high);
          (closest.signed_distance_mm(p - mid * n) > 0.0 ? low : high) = mid;
        }
        height.push_back(0.5 * (low + high));
      }
      p += 0.25 * n.cross(at.along).normalized();
    }
    for (std::size_t i = 4; i + 4 < height.size(); ++i) {
      const double crest = height[i];
      if (crest < 1.5 || *std::max_element(&height[i - 4], &height[i + 5]) > crest) continue;
      std::size_t left = i, right = i;
      while (left > 0 && height[left] >= 0.5 * crest && height[left] <= crest) --left;
      while (right + 1 < height.size() && height[right] >= 0.5 * crest && height[right] <= crest)
        ++right;
      // junctions, where a higher fold follows without a valley, have no thickness of their own
      if (height[left] >= 0.5 * crest || height[right] >= 0.5 * crest) continue;
      thickness_mm.push_back(0.25 * static_cast<double>(right - left - 1));
      crest_mm.push_back(crest);
    }
  }
  ASSERT_GE(thickness_mm.size(), 30u);
  RecordProperty("folds", static_cast<int>(thickness_mm.size()));
  RecordProperty("median_thickness_um", static_cast<int>(1000 * percentile(thickness_mm, 0.5)));
  EXPECT_TRUE(percentile(thickness_mm, 0.5) >= 3.0 && percentile(thickness_mm, 0.5) <= 5.0)
      << percentile(thickness_mm, 0.5);
  // folds that are cut at a slant look thicker, folds that end look thinner
  EXPECT_TRUE(percentile(thickness_mm, 0.15) >= 2.5) << percentile(thickness_mm, 0.15);
  EXPECT_TRUE(percentile(thickness_mm, 0.85) <= 6.0) << percentile(thickness_mm, 0.85);
  EXPECT_TRUE(percentile(crest_mm, 0.9) >= 2.5 && percentile(crest_mm, 0.9) <= 5.0)
      << percentile(crest_mm, 0.9);
}

TEST(Stomach, RegionsLieWhereAnAnatomistLooksForThem) {
  const StomachShape shape({}, 1);
  const StomachWall& wall = coarse();
  struct Mean {
    Vec3 p = Vec3::Zero();
    double s_mm = 0.0, cos_greater = 0.0;
    int count = 0;
  };
  std::map<Region, Mean> means;
  for (std::size_t v = 0; v < wall.mesh.vertices.size(); ++v) {
    const AxisPoint at = shape.locate(wall.mesh.vertices[v]);
    Mean& m = means[wall.regions[v]];
    m.p += wall.mesh.vertices[v];
    m.s_mm += at.s_mm;
    m.cos_greater += at.cos_greater;
    ++m.count;
  }
  for (auto& [region, m] : means) {
    m.p /= m.count;
    m.s_mm /= m.count;
    m.cos_greater /= m.count;
    EXPECT_GE(m.count, 70) << region_name(region);  // the mean canal has 100, a drawn one less
  }
  EXPECT_EQ(means.count(Region::unknown), 0u);
  for (const Region r : {Region::cardia, Region::fundus, Region::body, Region::incisura,
                         Region::antrum, Region::pylorus, Region::oesophagus, Region::duodenum})
    ASSERT_EQ(means.count(r), 1u) << region_name(r);
  // along the axis
  EXPECT_LT(means[Region::fundus].s_mm, means[Region::body].s_mm);
  EXPECT_LT(means[Region::body].s_mm, means[Region::incisura].s_mm);
  EXPECT_LT(means[Region::incisura].s_mm, means[Region::pylorus].s_mm);
  EXPECT_LT(means[Region::antrum].s_mm, means[Region::pylorus].s_mm);
  EXPECT_LT(means[Region::pylorus].s_mm, means[Region::duodenum].s_mm);
  // the dome of the fundus rises above the cardia (z up), which lies on the right (x left)
  EXPECT_GT(means[Region::fundus].p.z(), means[Region::cardia].p.z());
  double top = -1e9, cardia_top = -1e9;
  for (std::size_t v = 0; v < wall.mesh.vertices.size(); ++v) {
    double& highest = wall.regions[v] == Region::cardia ? cardia_top : top;
    if (wall.regions[v] == Region::cardia || wall.regions[v] == Region::fundus)
      highest = std::max(highest, wall.mesh.vertices[v].z());
  }
  EXPECT_GE(top - cardia_top, 15.0);
  EXPECT_LT(means[Region::cardia].p.x(), means[Region::fundus].p.x());
  // the incisura notches the lesser curvature
  EXPECT_LT(means[Region::incisura].cos_greater, -0.7);
  // the pylorus lies right of and above the lowest point: the J's hook
  EXPECT_LT(means[Region::pylorus].p.x(), means[Region::body].p.x() - 60.0);
  EXPECT_GT(means[Region::pylorus].p.z(), bounding_box(wall.mesh).min().z() + 40.0);
}

TEST(Stomach, TheLesserCurvatureIsNotchedAndTheGreaterIsNot) {
  // In the frontal plane, the way along the lesser curvature bends by more than the way along the
  // greater curvature is wide: compare the lengths of both from the level of the cardia.
  const StomachShape shape({}, 1);
  const FoldZone zone = shape.fold_zone();
  std::map<int, Vec3> lesser, greater;
  for (std::size_t v = 0; v < coarse().mesh.vertices.size(); ++v) {
    const Vec3& p = coarse().mesh.vertices[v];
    const AxisPoint at = shape.locate(p);
    if (at.s_mm < zone.rise_from_mm || std::abs(at.cos_greater) < 0.98) continue;
    auto& way = at.cos_greater > 0.0 ? greater : lesser;
    way.emplace(static_cast<int>(at.s_mm / 8.0), p);
  }
  const auto length = [](const std::map<int, Vec3>& way) {
    double sum = 0.0;
    for (auto it = std::next(way.begin()); it != way.end(); ++it)
      sum += (it->second - std::prev(it)->second).norm();
    return sum;
  };
  EXPECT_GE(length(greater), 1.5 * length(lesser));
}

TEST(Stomach, TheSameSeedGivesTheSameBytesOnAnyNumberOfThreads) {
  const StomachWall again = make_stomach({}, 1, kCoarseMm);
  EXPECT_EQ(again.mesh.vertices, coarse().mesh.vertices);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const StomachWall alone = make_stomach({}, 1, kCoarseMm);
  EXPECT_EQ(alone.mesh.vertices, coarse().mesh.vertices);
  EXPECT_EQ(alone.mesh.triangles, coarse().mesh.triangles);
  EXPECT_EQ(alone.mesh.normals, coarse().mesh.normals);
  EXPECT_EQ(alone.regions, coarse().regions);
}

TEST(Stomach, EverySeedGivesAnotherStomachWithinAnatomicalBounds) {
  std::vector<double> volumes_ml, lengths_mm, pylorus_x_mm;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const StomachWall wall = make_stomach({}, seed, kCoarseMm);
    const StomachShape shape({}, seed);
    const EdgeReport edges = inspect_edges(wall.mesh);
    EXPECT_TRUE(edges.closed() && edges.flipped == 0) << seed;
    EXPECT_EQ(wall.mesh.vertices.size() - wall.mesh.triangles.size() / 2, 2u) << seed;
    EXPECT_EQ(self_intersections(wall.mesh), 0) << seed;
    volumes_ml.push_back(signed_volume_mm3(wall.mesh) / 1000.0);
    lengths_mm.push_back(shape.length_mm());
    Vec3 sum = Vec3::Zero();
    int count = 0;
    for (std::size_t v = 0; v < wall.mesh.vertices.size(); ++v)
      if (wall.regions[v] == Region::pylorus) {
        sum += wall.mesh.vertices[v];
        ++count;
      }
    ASSERT_GE(count, 20) << seed;
    pylorus_x_mm.push_back(sum.x() / count);
    EXPECT_TRUE(volumes_ml.back() >= 1200.0 && volumes_ml.back() <= 1800.0) << volumes_ml.back();
    EXPECT_TRUE(lengths_mm.back() >= 200.0 && lengths_mm.back() <= 300.0) << lengths_mm.back();
  }
  const auto spread = [](const std::vector<double>& v) {
    return *std::ranges::max_element(v) - *std::ranges::min_element(v);
  };
  EXPECT_GE(spread(volumes_ml), 50.0);
  EXPECT_GE(spread(lengths_mm), 5.0);
  EXPECT_GE(spread(pylorus_x_mm), 5.0);
}

TEST(Stomach, AnotherSeedGivesOtherFoldsOfTheSameStrength) {
  StomachOptions mean;
  mean.variation = 0.0;
  const StomachShape shape(mean, 1);
  const StomachWall one = make_stomach(mean, 1, kCoarseMm),
                    other = make_stomach(mean, 2, kCoarseMm);
  ASSERT_EQ(other.mesh.vertices.size(), one.mesh.vertices.size());  // the same smooth shape
  double a = 0.0, b = 0.0, ab = 0.0;
  for (std::size_t v = 0; v < other.mesh.vertices.size(); ++v) {
    if (other.regions[v] != Region::body) continue;
    const double ha = height_at(shape, one.mesh.vertices[v]);
    const double hb = height_at(shape, other.mesh.vertices[v]);
    a += ha * ha;
    b += hb * hb;
    ab += (ha - hb) * (ha - hb);
  }
  EXPECT_NEAR(std::sqrt(b / a), 1.0, 0.25);
  EXPECT_GE(ab, 0.5 * a);
}

TEST(Stomach, ResolutionsSampleTheSameSurface) {
  EXPECT_NEAR(static_cast<double>(coarse().mesh.triangles.size()), 50e3, 5e3);
  EXPECT_NEAR(static_cast<double>(medium().mesh.triangles.size()), 250e3, 25e3);
  // Every vertex lies on the surface itself, so a coarse vertex is off the medium mesh by that
  // mesh's chords alone: edge^2 / (8 r), r about 2 mm on a crest, edges to 1.5 mm.
  const ClosestPoint closest(medium().mesh);
  std::vector<double> distance;
  for (std::size_t v = 0; v < coarse().mesh.vertices.size(); v += 5)
    distance.push_back(closest(coarse().mesh.vertices[v]).distance_mm);
  EXPECT_TRUE(percentile(distance, 0.5) <= 0.05) << percentile(distance, 0.5);
  EXPECT_TRUE(percentile(distance, 0.95) <= 0.15) << percentile(distance, 0.95);
  EXPECT_TRUE(percentile(distance, 1.0) <= 0.6) << percentile(distance, 1.0);
}

TEST(Stomach, AreaeAreFineShallowAndPolygonal) {
  const StomachShape shape({}, 1);
  StomachOptions options;
  options.relief.rugae_height_mm = 0.0;
  const StomachWall wall = make_stomach(options, 1, kMediumMm);
  double low = 0.0, high = -1e9, flat = 0.0;
  for (const Vec3& p : wall.mesh.vertices) {
    const double h = height_at(shape, p);
    low = std::min(low, h);
    high = std::max(high, h);
    flat += h > -0.3 * options.relief.areae_depth_mm;
  }
  constexpr double kSmall = 1e-3;  // mm: what the Newton steps leave
  EXPECT_NEAR(low, -options.relief.areae_depth_mm, 0.02);
  EXPECT_NEAR(high, 0.0, kSmall);
  // most of the wall is areae, furrows are narrow
  EXPECT_GE(flat / wall.mesh.vertices.size(), 0.5);
  EXPECT_LE(flat / wall.mesh.vertices.size(), 0.9);
}

}  // namespace
}  // namespace rugae
