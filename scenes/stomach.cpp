#include "scenes/stomach.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/check.h"
#include "core/portable_math.h"
#include "core/random.h"
#include "scenes/isosurface.h"
#include "scenes/subdivide.h"

namespace rugae {
namespace {

// The J-shaped axis with its calibre, mm. Lengths and widths assumed within the ranges of
// textbooks: greatest width in the fundus and upper body, about 10 cm; antrum 5 to 6 cm; pyloric
// canal 1.5 cm.
struct Station {
  double x, y, z, radius;
};
constexpr Station kAxis[] = {
    {36, 10, 38, 48.5},     // 0 centre of the fundus' dome
    {40, 9, 20, 54},        // 1
    {39, 6, 0, 55.5},       // 2 level of the cardia
    {34, 3, -24, 54},       // 3
    {27, 0, -48, 51},       // 4 body
    {15, -4, -71, 46.5},    // 5
    {-5, -8, -89, 40},      // 6 below the incisura
    {-29, -11, -94, 33.5},  // 7 antrum
    {-50, -11, -86, 28.5},  // 8
    {-66, -9, -72, 20},     // 9
    {-76, -6, -59, 9},      // 10 pyloric canal
    {-82, -4, -49, 6},      // 11
    {-89, 1, -41, 8},       // 12 first centimetres of the duodenum, a blind stub that turns back
    {-94, 14, -37, 9},      // 13
};
constexpr Station kOesophagus[] = {
    {0, 6, 12, 9}, {-19, 6, 29, 5.5}, {-29, 9, 43, 4.5}, {-33, 20, 55, 4.5}};  // nearly closed
constexpr std::size_t kCardiaNode = 2, kBodyNode = 4, kIncisuraNode = 6, kAntrumNode = 7,
                      kPylorusNode = 10, kDuodenumNode = 12;
constexpr double kFlattening = 0.92;  // front to back, of a distended stomach; assumed

// Largest changes that a seed makes; assumed, and such that every stomach stays within 1.2 to 1.8 l
// and 200 to 300 mm.
constexpr double kBendTurns = 14.0 / 360.0, kStretch = 0.06, kSwingMm = 5.0;
constexpr double kWiden = 0.06, kTaper = 0.07, kCanal = 0.15, kVolume = 0.10;
constexpr double kFoldHeight = 0.2, kFoldSize = 0.1;

// Numbers from -1 to 1, times the variation.
std::array<double, 4> changes(const StomachOptions& options, std::uint64_t seed,
                              std::uint64_t index) {
  auto u = random_uniform(seed, Purpose::scene_draw, 0, index);
  for (double& v : u) v = options.variation * (2.0 * v - 1.0);
  return u;
}

// The product of the balls' sections and their distances: nearly in proportion to the volume.
double tube_volume(const std::vector<AxisNode>& nodes) {
  double sum = 0.0;
  for (std::size_t i = 1; i < nodes.size(); ++i) {
    const double r = 0.5 * (nodes[i - 1].radius_mm + nodes[i].radius_mm);
    sum += r * r * (nodes[i].centre - nodes[i - 1].centre).norm();
  }
  const double dome = nodes[0].radius_mm;
  return sum + 2.0 / 3.0 * dome * dome * dome;
}

double cube_root(double x) {
  double root = 1.0;
  for (int step = 0; step < 20; ++step) root -= (root * root * root - x) / (3.0 * root * root);
  return root;
}

// Node i of the mean axis moves by the turned and stretched steps before it.
std::vector<AxisNode> main_axis(const StomachOptions& options, std::uint64_t seed, double& scale,
                                double& top_radius_mm) {
  const auto bend = changes(options, seed, 0), width = changes(options, seed, 1);
  std::vector<AxisNode> mean, nodes;
  const int last = static_cast<int>(std::size(kAxis)) - 1;
  for (const Station& s : kAxis) mean.push_back({Vec3(s.x, s.y, s.z), s.radius});
  nodes = mean;
  for (int i = 0; i <= last; ++i) {
    const double along = static_cast<double>(i) / last;
    nodes[i].radius_mm *=
        (1.0 + kWiden * width[0]) * (1.0 + kTaper * width[1] * (1.0 - 2.0 * along));
    if (i >= static_cast<int>(kPylorusNode)) nodes[i].radius_mm *= 1.0 + kCanal * width[2];
    if (i <= static_cast<int>(kCardiaNode)) continue;
    // from the body on, the hook opens or closes in the frontal plane and swings to front or back
    const double hook = smooth_step(2.0, 8.0, static_cast<double>(i));
    const SineCosine sc = portable_turn(kBendTurns * bend[0] * hook);
    const Vec3 step = mean[i].centre - mean[i - 1].centre;
    nodes[i].centre =
        nodes[i - 1].centre +
        (1.0 + kStretch * bend[1]) * Vec3(sc.cosine * step.x() + sc.sine * step.z(), step.y(),
                                          sc.cosine * step.z() - sc.sine * step.x());
    nodes[i].centre.y() += kSwingMm * bend[2] * (hook - smooth_step(2.0, 8.0, i - 1.0));
  }
  scale = options.scale *
          cube_root(tube_volume(mean) / tube_volume(nodes) * (1.0 + kVolume * width[3]));
  for (AxisNode& node : nodes) node = {scale * node.centre, scale * node.radius_mm};
  top_radius_mm = nodes[0].radius_mm;
  return nodes;
}

std::vector<AxisNode> oesophagus_axis(double scale) {
  std::vector<AxisNode> nodes;
  for (const Station& s : kOesophagus)
    nodes.push_back({scale * Vec3(s.x, s.y, s.z), scale * s.radius});
  return nodes;
}

ReliefOptions drawn_relief(const StomachOptions& options, std::uint64_t seed) {
  const auto change = changes(options, seed, 2);
  ReliefOptions relief = options.relief;
  relief.rugae_height_mm *= 1.0 + kFoldHeight * change[0];
  relief.rugae_spacing_mm *= 1.0 + kFoldSize * change[1];
  relief.rugae_thickness_mm *= 1.0 + kFoldSize * change[2];
  return relief;
}

}  // namespace

std::string region_name(Region region) {
  switch (region) {
    case Region::unknown:
      return "unknown";
    case Region::cardia:
      return "cardia";
    case Region::fundus:
      return "fundus";
    case Region::body:
      return "body";
    case Region::incisura:
      return "incisura";
    case Region::antrum:
      return "antrum";
    case Region::pylorus:
      return "pylorus";
    case Region::oesophagus:
      return "oesophagus";
    case Region::duodenum:
      return "duodenum";
  }
  return "unknown";
}

void StomachOptions::check(const std::string& where) const {
  rugae::check(scale >= 0.3 && scale <= 2.0, "{}: scale is {}, expected 0.3 to 2", where, scale);
  rugae::check(variation >= 0.0 && variation <= 1.0, "{}: variation is {}, expected 0 to 1", where,
               variation);
  relief.check(where);
  instances.check(where);
}

StomachShape::StomachShape(const StomachOptions& options, std::uint64_t seed)
    : scale_(options.scale),
      // main_axis sets scale_: of arguments of one call nobody knows which is worked out first
      axis_(main_axis(options, seed, scale_, top_radius_mm_), 6.0 * options.scale,
            4.0 * options.scale, kFlattening, Vec3::UnitY()),
      oesophagus_(oesophagus_axis(scale_), 4.0 * scale_, 2.0 * scale_, 1.0, Vec3::UnitY()) {}

double StomachShape::distance_mm(const Vec3& p, Vec3* gradient) const {
  Vec3 g0, g1;
  const double d0 = axis_.distance_mm(p, gradient ? &g0 : nullptr);
  const double d1 = oesophagus_.distance_mm(p, gradient ? &g1 : nullptr);
  // smooth minimum of the two: -k ln(exp(-d0/k) + exp(-d1/k))
  const double k = 5.0 * scale_, least = std::min(d0, d1);
  const double w0 = portable_exp((least - d0) / k), w1 = portable_exp((least - d1) / k);
  if (gradient) *gradient = (w0 * g0 + w1 * g1) / (w0 + w1);
  return least - k * portable_log(w0 + w1);
}

Region StomachShape::region(const Vec3& p, const AxisPoint& at) const {
  const double stub = oesophagus_.distance_mm(p);
  if (stub < at.distance_mm - 4.0 * scale_) return Region::oesophagus;
  if (stub < 15.0 * scale_ && at.s_mm < axis_.node_s_mm(kBodyNode)) return Region::cardia;
  if (at.s_mm > axis_.node_s_mm(kDuodenumNode)) return Region::duodenum;
  if (at.s_mm > axis_.node_s_mm(kPylorusNode)) return Region::pylorus;
  // the fundus is the dome above the level of the cardia
  if (at.s_mm < axis_.node_s_mm(kCardiaNode)) return Region::fundus;
  const double off_incisura = std::abs(at.s_mm - axis_.node_s_mm(kIncisuraNode));
  if (at.cos_greater < -0.7 && off_incisura < 12.0 * scale_) return Region::incisura;
  return at.s_mm < axis_.node_s_mm(kIncisuraNode) ? Region::body : Region::antrum;
}

FoldZone StomachShape::fold_zone() const {
  FoldZone zone;
  zone.rise_from_mm = axis_.node_s_mm(1);
  zone.rise_to_mm = axis_.node_s_mm(3);
  zone.fall_from_mm = axis_.node_s_mm(5);
  zone.fall_to_mm = axis_.node_s_mm(kAntrumNode + 1);
  return zone;
}

PeristalsisZone StomachShape::peristalsis_zone() const {
  return {.rise_from_mm = axis_.node_s_mm(kBodyNode - 1),
          .rise_to_mm = axis_.node_s_mm(kAntrumNode),
          .fall_from_mm = axis_.node_s_mm(kPylorusNode),
          .fall_to_mm = axis_.node_s_mm(kDuodenumNode)};
}

Eigen::AlignedBox3d StomachShape::box() const { return axis_.box().merged(oesophagus_.box()); }

double StomachShape::length_mm() const {
  return top_radius_mm_ + axis_.node_s_mm(kPylorusNode + 1);
}

namespace {

// The wall that is nearest to a point within a few millimetres of it, by Newton's method.
PlaceOnWall place_on(const StomachShape& shape, const Relief& relief) {
  return [&](const Vec3& near_mm, WallPlace& place) {
    constexpr double kNearMm = 8.0;
    Vec3 p = near_mm, gradient;
    double distance = shape.distance_mm(p, &gradient);
    if (std::abs(distance) > kNearMm) return false;
    for (int step = 0; step < 8; ++step) {
      p -= distance / gradient.squaredNorm() * gradient;
      distance = shape.distance_mm(p, &gradient);
    }
    constexpr double kOnTheWallMm = 1e-6;
    if (!(std::abs(distance) <= kOnTheWallMm)) return false;
    const AxisPoint at = shape.locate(p);
    place.inward = -gradient.normalized();
    place.p_mm = p + relief.height_mm(p, at) * place.inward;
    place.region = shape.region(p, at);
    return true;
  };
}

}  // namespace

StomachWall make_stomach(const StomachOptions& options, std::uint64_t seed, double cell_mm) {
  const StomachShape shape(options, seed);
  const Relief relief(drawn_relief(options, seed), shape.fold_zone(), shape.axis(), seed);
  constexpr int kRelaxRounds = 6;
  StomachWall wall;
  wall.mesh = isosurface([&](const Vec3& p, Vec3* g) { return shape.distance_mm(p, g); },
                         shape.box(), cell_mm, kRelaxRounds, "stomach");
  auto& vertices = wall.mesh.vertices;
  wall.regions.resize(vertices.size());
  wall.instances = place_instances(options.instances, shape.box(), area_mm2(wall.mesh),
                                   place_on(shape, relief), seed, "stomach");
  const Instances instances(wall.instances);
  tbb::parallel_for(std::size_t{0}, vertices.size(), [&](std::size_t v) {
    const Vec3 p = vertices[v];
    Vec3 gradient;
    shape.distance_mm(p, &gradient);
    const AxisPoint at = shape.locate(p);
    wall.regions[v] = shape.region(p, at);
    const Vec3 folded = p - relief.height_mm(p, at) * gradient.normalized();
    const Instances::Hit hit = instances.at(folded);
    vertices[v] =
        hit.instance ? Vec3(folded + Instances::raise_mm(hit) * hit.instance->inward) : folded;
  });
  recut_quads(wall.mesh);
  wall.mesh.normals = smooth_normals(wall.mesh);
  return wall;
}

}  // namespace rugae
