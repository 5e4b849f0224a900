// Lesions and objects: where they are, how high they stand, and what is said of wrong ones.

#include "scenes/instances.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <set>

#include "core/files.h"
#include "core/mesh.h"
#include "core/presets.h"
#include "core/random.h"
#include "core/units.h"
#include "scenes/stomach.h"
#include "self_intersection.h"
#include "tests/message_of.h"

namespace rugae {
namespace {

constexpr double kMediumMm = 0.96, kCoarseMm = 2.12;

StomachOptions diseased() {
  StomachOptions options;
  options.instances = {.polyp = 6,
                       .ulcer = 4,
                       .erosion = 5,
                       .bleeding = 4,
                       .angiectasia = 5,
                       .debris = 8,
                       .bubbles = 30,
                       .mucus = 0.04};
  return options;
}
const StomachWall& sick() {
  static const StomachWall wall = make_stomach(diseased(), 1, kMediumMm);
  return wall;
}

WallInstance disc(double radius_mm, double irregularity) {
  WallInstance w;
  w.id = 7;
  w.kind = InstanceKind::polyp;
  w.centre_mm = Vec3(3, -2, 5);
  w.inward = Vec3(0.48, 0.6, 0.64);
  w.radius_mm = radius_mm;
  w.height_mm = 0.55 * radius_mm;
  w.outline = 12345;
  w.irregularity = irregularity;
  return w;
}

// Area of the plane through the middle that an instance holds, on a fine grid.
double area_on_a_plane_mm2(const WallInstance& w, double step_mm) {
  const Instances instances({w});
  const Vec3 u = w.inward.cross(Vec3::UnitX()).normalized(), v = w.inward.cross(u);
  const int n = static_cast<int>(2.0 * w.radius_mm / step_mm);
  double area = 0.0;
  for (int j = -n; j <= n; ++j)
    for (int i = -n; i <= n; ++i)
      if (instances.at(w.centre_mm + step_mm * (i + 0.5) * u + step_mm * (j + 0.5) * v).instance)
        area += step_mm * step_mm;
  return area;
}

TEST(Instances, ARoundOneHoldsTheAreaOfItsDisc) {
  // Gauss's circle problem: counting cells errs by about the perimeter's cells to the power 2/3.
  constexpr double kCounting = 2e-3;
  const double area = area_on_a_plane_mm2(disc(4.0, 0.0), 0.02);
  EXPECT_TRUE(std::abs(area / (kPi * 16.0) - 1.0) <= kCounting) << area;
}

TEST(Instances, AnIrregularOneHoldsTheAreaInsideItsOutline) {
  // area = 1/2 integral of (radius outline)^2, the outline found by bisection on 3600 rays
  const WallInstance w = disc(4.0, 0.6);
  const Instances instances({w});
  const Vec3 u = w.inward.cross(Vec3::UnitX()).normalized(), v = w.inward.cross(u);
  double area = 0.0, least = 1e9, most = 0.0;
  constexpr int kRays = 3600;
  for (int i = 0; i < kRays; ++i) {
    const double angle = 2.0 * kPi * i / kRays;
    const Vec3 ray = std::cos(angle) * u + std::sin(angle) * v;
    double in = 0.0, out = 2.0 * w.radius_mm;
    for (int k = 0; k < 40; ++k) {
      const double mid = 0.5 * (in + out);
      (instances.at(w.centre_mm + mid * ray).instance ? in : out) = mid;
    }
    area += kPi / kRays * in * in;
    least = std::min(least, in);
    most = std::max(most, in);
  }
  constexpr double kCounting = 2e-3;
  EXPECT_TRUE(std::abs(area_on_a_plane_mm2(w, 0.02) / area - 1.0) <= kCounting);
  EXPECT_GE(least, (1.0 - 0.5 * w.irregularity) * w.radius_mm - 1e-6);
  EXPECT_LE(most, (1.0 + 0.5 * w.irregularity) * w.radius_mm + 1e-6);
  EXPECT_GE(most - least, 0.2 * w.radius_mm);  // it is irregular
}

TEST(Instances, RaisingTheWallMovesNoOutline) {
  const WallInstance w = disc(4.0, 0.4);
  const Instances instances({w});
  constexpr double kRounding = 1e-9;
  for (int i = 0; i < 500; ++i) {
    const auto u = random_uniform(3, Purpose::test, 0, static_cast<std::uint64_t>(i));
    const Vec3 p = w.centre_mm + 8.0 * Vec3(u[0] - 0.5, u[1] - 0.5, u[2] - 0.5);
    const auto before = instances.at(p), after = instances.at(p + 2.5 * w.inward);
    ASSERT_EQ(before.instance != nullptr, after.instance != nullptr);
    if (before.instance) {
      EXPECT_NEAR(before.rho, after.rho, kRounding);
    }
  }
  // not on the other side of the lumen
  EXPECT_EQ(instances.at(w.centre_mm + 30.0 * w.inward).instance, nullptr);
}

TEST(Instances, EveryKindIsThereAndNoneTouchesAnother) {
  const auto& list = sick().instances;
  std::array<int, kInstanceKinds.size()> count{};
  std::set<Region> regions;
  for (std::size_t i = 0; i < list.size(); ++i) {
    EXPECT_EQ(list[i].id, static_cast<int>(i) + 1);
    ++count[static_cast<std::size_t>(list[i].kind)];
    regions.insert(list[i].region);
    EXPECT_NEAR(list[i].inward.norm(), 1.0, 1e-12);
  }
  const std::vector<int> asked = {6, 4, 5, 4, 5, 8, 30};
  EXPECT_TRUE(std::equal(asked.begin(), asked.end(), count.begin()));
  EXPECT_GE(count.back(), 3);  // pools of mucus
  EXPECT_EQ(regions, (std::set<Region>{Region::fundus, Region::body, Region::antrum}));
  // no vertex lies in two of them: asked alone, each gives the same answer as among the others
  std::vector<Instances> alone;
  for (const WallInstance& w : list) alone.emplace_back(std::vector<WallInstance>{w});
  const Instances all(list);
  std::vector<int> vertices(list.size(), 0);
  for (const Vec3& p : sick().mesh.vertices) {
    int holders = 0;
    const Instances::Hit hit = all.at(p);
    for (std::size_t i = 0; i < list.size(); ++i)
      if (alone[i].at(p).instance) {
        ++holders;
        ++vertices[i];
        ASSERT_TRUE(hit.instance && hit.instance->id == list[i].id);
      }
    ASSERT_LE(holders, 1);
  }
  for (std::size_t i = 0; i < list.size(); ++i)
    if (list[i].radius_mm > 1.5) {
      EXPECT_GE(vertices[i], 4) << list[i].id;
    }
}

TEST(Instances, APolypRaisesTheWallByItsHeight) {
  for (const WallInstance& w : sick().instances) {
    if (w.kind != InstanceKind::polyp) continue;
    // the same wall without it, along the polyp's axis
    const Instances instances({w});
    const Instances::Hit middle = instances.at(w.centre_mm);
    ASSERT_NE(middle.instance, nullptr);
    EXPECT_EQ(Instances::raise_mm(middle), w.height_mm);
    double highest = -1e9;
    for (const Vec3& p : sick().mesh.vertices)
      if (instances.at(p).instance && instances.at(p).rho < 0.6)
        highest = std::max(highest, w.inward.dot(p - w.centre_mm));
    // folds and the organ's curvature around the middle add or take off less than a fold's height
    EXPECT_GE(highest, 0.8 * w.height_mm);
    EXPECT_LE(highest, w.height_mm + diseased().relief.rugae_height_mm);
  }
}

TEST(Instances, UlcersAreCraters) {
  WallInstance w = disc(6.0, 0.0);
  w.kind = InstanceKind::ulcer;
  w.height_mm = 0.6;
  const auto raise = [&](double rho) { return Instances::raise_mm({&w, rho, Vec3::UnitX()}); };
  EXPECT_TRUE(std::abs(raise(0.0) + 0.22 * 6.0) <= 1e-12);
  EXPECT_TRUE(std::abs(raise(0.75) - 0.6) <= 1e-12);
  EXPECT_TRUE(std::abs(raise(0.999999)) <= 1e-9);
}

TEST(Instances, TheWallStaysWhole) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const StomachWall wall = make_stomach(diseased(), seed, seed == 1 ? kMediumMm : kCoarseMm);
    const EdgeReport edges = inspect_edges(wall.mesh);
    EXPECT_TRUE(edges.closed());
    EXPECT_EQ(edges.flipped, 0u);
    EXPECT_EQ(self_intersections(wall.mesh), 0) << "seed " << seed;
  }
}

TEST(Instances, LieInTheSamePlacesAtEveryResolutionAndElsewhereForAnotherSeed) {
  const StomachWall coarse = make_stomach(diseased(), 1, kCoarseMm);
  // the share of mucus is of the mesh's area: another resolution may take one pool more or less
  const auto lesions = static_cast<std::size_t>(6 + 4 + 5 + 4 + 5 + 8 + 30);
  for (std::size_t i = 0; i < lesions; ++i)
    EXPECT_EQ(coarse.instances[i].centre_mm, sick().instances[i].centre_mm);
  const StomachWall other = make_stomach(diseased(), 2, kCoarseMm);
  for (std::size_t i = 0; i < lesions; ++i)
    EXPECT_GE((other.instances[i].centre_mm - sick().instances[i].centre_mm).norm(), 0.1);
}

TEST(Instances, ColoursStayPhysical) {
  MucosaSample wall;
  wall.albedo = Vec3f(0.62f, 0.21f, 0.1f);
  int painted = 0;
  for (int kind = 0; kind < static_cast<int>(kInstanceKinds.size()); ++kind) {
    WallInstance w = disc(4.0, 0.3);
    w.kind = static_cast<InstanceKind>(kind);
    const Instances instances({w});
    for (int i = 0; i < 3000; ++i) {
      const auto u = random_uniform(9, Purpose::test, static_cast<std::uint32_t>(kind),
                                    static_cast<std::uint64_t>(i));
      const Vec3 p = w.centre_mm + 7.0 * Vec3(u[0] - 0.5, u[1] - 0.5, u[2] - 0.5);
      const auto hit = instances.at(p);
      if (!hit.instance) continue;
      MucosaSample s = wall;
      const Vec3f n = -w.inward.cast<float>();
      paint_instance(hit, p, n, s);
      for (int c = 0; c < 3; ++c) ASSERT_TRUE(s.albedo[c] > 0.0f && s.albedo[c] < 1.0f);
      ASSERT_TRUE(s.roughness > 0.0f && s.roughness <= 1.0f);
      ASSERT_TRUE(s.coverage >= 0.0f && s.coverage <= 1.0f);
      ASSERT_TRUE(s.f0 > 0.0f && s.f0 < 0.1f);
      ASSERT_TRUE(std::abs(s.coat_gradient.dot(n)) <= 1e-5f);
      ASSERT_TRUE(s.coat_gradient.norm() <= 1.5f);
      painted += s.albedo != wall.albedo;
    }
  }
  EXPECT_GE(painted, 3000);
}

TEST(Instances, AreListedInTheTruth) {
  WallInstance w = disc(4.0, 0.0);
  w.region = Region::antrum;
  EXPECT_EQ(instances_csv({w}),
            "id,kind,x_mm,y_mm,z_mm,inward_x,inward_y,inward_z,radius_mm,height_mm,region\n"
            "7,polyp,3.000000,-2.000000,5.000000,0.480000,0.600000,0.640000,4.0000,2.2000,antrum"
            "\n");
}

TEST(Instances, WrongOnesAreToldInOneLine) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(::testing::TempDir()) / "rugae_instances";
  fs::create_directories(folder);
  const auto error = [&](const std::string& text) {
    const fs::path file = folder / "scene.yaml";
    write_atomic(file, text);
    const std::string message = message_of(
        [&] { load_scene({.name_or_path = file.string(), .seed = 1, .resolution = "coarse"}); });
    return message.substr(std::min(message.size(), file.string().size()));
  };
  EXPECT_EQ(error("lesions: {polyp: -1}\n"), ": lesions: polyp is -1, expected 0 to 255");
  EXPECT_EQ(error("lesions: {polip: 1}\n"), ":1:11: unknown key 'polip'; did you mean 'polyp'?");
  EXPECT_EQ(error("lesions: {ulcer: many}\n"), ":1:18: ulcer is 'many', expected a whole number");
  EXPECT_EQ(error("objects: {mucus: 0.5}\n"), ": objects: mucus is 0.5, expected 0 to 0.2");
  EXPECT_EQ(error("objects: {mucus: .nan}\n"), ":1:18: mucus is '.nan', expected a finite number");
  EXPECT_EQ(error("kind: mesh\nmesh: a.ply\nlesions: {polyp: 1}\n"),
            ":3:10: lesions need a stomach of kind procedural");
  StomachOptions options;
  options.instances.polyp = options.instances.ulcer = 200;
  options.relief.rugae_height_mm = 0.0;
  EXPECT_EQ(message_of([&] { make_stomach(options, 1, 4.0); }),
            "stomach: more than 255 lesions and objects");
}

}  // namespace
}  // namespace rugae
