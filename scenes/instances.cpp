#include "scenes/instances.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/check.h"
#include "core/portable_math.h"
#include "core/random.h"
#include "core/units.h"
#include "scenes/lattice_noise.h"

namespace rugae {
namespace {

constexpr double kBoxMm = 12.0;     // of the grid that finds instances
constexpr double kApartMm = 1.0;    // between outlines, at least
constexpr int kTries = 40000;       // for each instance
constexpr double kMostMucus = 0.2;  // beyond it, pools that do not touch find no room

// Radii in mm, heights over the radius, irregularity of the outline. Gastric polyps are mostly
// below 10 mm across, erosions below 5 mm, ulcers from 5 mm on; the rest is assumed.
struct Size {
  double least_mm, most_mm, height_over_radius, irregularity;
};
constexpr Size kSizes[] = {
    {2.0, 5.0, 0.55, 0.10},  // polyp
    {3.0, 8.0, 0.10, 0.25},  // ulcer: the rim
    {1.2, 2.5, 0.0, 0.35},   // erosion
    {1.5, 4.0, 0.0, 0.60},   // bleeding
    {1.5, 4.0, 0.0, 0.40},   // angiectasia
    {1.0, 3.5, 0.50, 0.45},  // debris
    {0.5, 2.2, 0.0, 0.0},    // bubble
    {3.0, 10.0, 0.0, 0.60},  // mucus
};
constexpr double kUlcerDepth = 0.22, kErosionDepth = 0.08;  // over the radius

constexpr double kOutlineFrequency = 1.2;  // of the noise, on the unit circle
constexpr double kOutlineLimit = 0.5;      // the noise is cut off there
double largest_radius_mm(const WallInstance& w) {
  return w.radius_mm * (1.0 + kOutlineLimit * w.irregularity);
}

void check_count(const std::string& where, const char* name, int value) {
  check(value >= 0 && value <= 255, "{}: {} is {}, expected 0 to 255", where, name, value);
}

}  // namespace

std::string instance_name(InstanceKind kind) {
  return kInstanceKinds[static_cast<std::size_t>(kind)];
}

void InstanceOptions::check(const std::string& where) const {
  check_count(where, "lesions: polyp", polyp);
  check_count(where, "lesions: ulcer", ulcer);
  check_count(where, "lesions: erosion", erosion);
  check_count(where, "lesions: bleeding", bleeding);
  check_count(where, "lesions: angiectasia", angiectasia);
  check_count(where, "objects: debris", debris);
  check_count(where, "objects: bubbles", bubbles);
  rugae::check(mucus >= 0.0 && mucus <= kMostMucus, "{}: objects: mucus is {}, expected 0 to {}",
               where, mucus, kMostMucus);
}

std::vector<WallInstance> place_instances(const InstanceOptions& options,
                                          const Eigen::AlignedBox3d& box, double area_mm2,
                                          const PlaceOnWall& place, std::uint64_t seed,
                                          const std::string& where) {
  constexpr Region kTurns[] = {Region::body, Region::antrum, Region::fundus};
  std::vector<WallInstance> list;
  const int counts[] = {options.polyp,       options.ulcer,  options.erosion, options.bleeding,
                        options.angiectasia, options.debris, options.bubbles};
  const auto add = [&](InstanceKind kind, int k) {
    const Size& size = kSizes[static_cast<std::size_t>(kind)];
    const auto stream = static_cast<std::uint32_t>(kind) << 16 | static_cast<std::uint32_t>(k);
    const auto drawn = random_uniform(seed, Purpose::scene_instances, stream, 0);
    WallInstance w;
    w.kind = kind;
    w.id = static_cast<int>(list.size()) + 1;
    check(w.id <= 255, "{}: more than 255 lesions and objects", where);
    w.radius_mm = size.least_mm + (size.most_mm - size.least_mm) * drawn[0];
    w.height_mm = size.height_over_radius * w.radius_mm;
    w.irregularity = size.irregularity;
    w.outline = random_words(seed, Purpose::scene_instances, stream, 1)[0];
    for (int attempt = 0; attempt < kTries; ++attempt) {
      const auto u = random_uniform(seed, Purpose::scene_instances, stream,
                                    2 + static_cast<std::uint64_t>(attempt));
      WallPlace found;
      if (!place(box.min() + Vec3(u[0], u[1], u[2]).cwiseProduct(box.sizes()), found)) continue;
      const bool any_region = attempt > kTries / 2;
      if (any_region ? std::ranges::count(kTurns, found.region) == 0
                     : found.region != kTurns[k % std::size(kTurns)])
        continue;
      w.centre_mm = found.p_mm;
      w.inward = found.inward;
      w.region = found.region;
      const bool touches = std::ranges::any_of(list, [&](const WallInstance& other) {
        return (other.centre_mm - w.centre_mm).norm() <
               largest_radius_mm(other) + largest_radius_mm(w) + kApartMm;
      });
      if (touches) continue;
      list.push_back(w);
      return;
    }
    fail("{}: no room on the wall for {} {}", where, instance_name(kind), k + 1);
  };
  for (std::size_t kind = 0; kind < std::size(counts); ++kind)
    for (int k = 0; k < counts[kind]; ++k) add(static_cast<InstanceKind>(kind), k);
  double covered_mm2 = 0.0;
  for (int k = 0; covered_mm2 < options.mucus * area_mm2; ++k) {
    add(InstanceKind::mucus, k);
    covered_mm2 += kPi * list.back().radius_mm * list.back().radius_mm;
  }
  return list;
}

Instances::Instances(std::vector<WallInstance> list) : list_(std::move(list)) {
  check(list_.size() <= 255, "{} lesions and objects, expected at most 255", list_.size());
  if (list_.empty()) return;
  Eigen::AlignedBox3d box;
  const auto reach = [](const WallInstance& w) {
    const double across = largest_radius_mm(w), along = w.radius_mm + kReachMm;
    return Vec3::Constant(std::sqrt(across * across + along * along));
  };
  for (const WallInstance& w : list_) {
    box.extend(w.centre_mm - reach(w));
    box.extend(w.centre_mm + reach(w));
  }
  origin_ = box.min();
  size_ = (box.sizes() / kBoxMm).array().ceil().cast<int>().max(1);
  boxes_.resize(static_cast<std::size_t>(size_.prod()));
  for (std::size_t i = 0; i < list_.size(); ++i) {
    const WallInstance& w = list_[i];
    const Vec3i top = size_ - Vec3i::Ones();
    const Vec3i low = ((w.centre_mm - reach(w) - origin_) / kBoxMm).array().floor().cast<int>();
    const Vec3i high = ((w.centre_mm + reach(w) - origin_) / kBoxMm).array().floor().cast<int>();
    for (int z = std::max(0, low.z()); z <= std::min(high.z(), top.z()); ++z)
      for (int y = std::max(0, low.y()); y <= std::min(high.y(), top.y()); ++y)
        for (int x = std::max(0, low.x()); x <= std::min(high.x(), top.x()); ++x)
          boxes_[x + size_.x() * (y + size_.y() * z)].push_back(static_cast<std::uint8_t>(i));
  }
}

Instances::Hit Instances::at(const Vec3& p_mm) const {
  Hit hit;
  const Vec3 cell = (p_mm - origin_) / kBoxMm;
  for (int a = 0; a < 3; ++a)
    if (!(cell[a] >= 0.0 && cell[a] < size_[a])) return hit;
  const Vec3i c = cell.cast<int>();
  for (const std::uint8_t i : boxes_[c.x() + size_.x() * (c.y() + size_.y() * c.z())]) {
    const WallInstance& w = list_[i];
    const Vec3 q = p_mm - w.centre_mm;
    const double along = w.inward.dot(q);
    if (std::abs(along) > w.radius_mm + kReachMm) continue;
    const Vec3 across = q - along * w.inward;
    const double off = std::sqrt(across.squaredNorm());
    if (off >= largest_radius_mm(w)) continue;
    const Vec3 outward = off > 0.0 ? Vec3(across / off) : Vec3::Zero();
    double outline = 1.0;
    if (w.irregularity > 0.0 && off > 0.0)
      outline +=
          w.irregularity * std::clamp(gradient_noise(kOutlineFrequency * outward, w.outline).value,
                                      -kOutlineLimit, kOutlineLimit);
    const double rho = off / (w.radius_mm * outline);
    if (rho >= 1.0) continue;
    return {&w, rho, outward};
  }
  return hit;
}

// Domes (1 - rho^4)^2 for polyps and (1 - rho^2)^2 for debris; an ulcer's rim stands around 3/4 of
// its radius, its base lies within half. All have a horizontal tangent on the outline.
double Instances::raise_mm(const Hit& hit) {
  if (!hit.instance) return 0.0;
  const WallInstance& w = *hit.instance;
  const double r2 = hit.rho * hit.rho;
  switch (w.kind) {
    case InstanceKind::polyp:
      return w.height_mm * (1.0 - r2 * r2) * (1.0 - r2 * r2);
    case InstanceKind::debris:
      return w.height_mm * (1.0 - r2) * (1.0 - r2);
    case InstanceKind::ulcer: {
      const double t = (hit.rho - 0.75) / 0.25;
      const double rim = std::abs(t) < 1.0 ? (1.0 - t * t) * (1.0 - t * t) : 0.0;
      return w.height_mm * rim - kUlcerDepth * w.radius_mm * smooth_step(0.68, 0.38, hit.rho);
    }
    case InstanceKind::erosion:
      return -kErosionDepth * w.radius_mm * (1.0 - r2) * (1.0 - r2);
    default:
      return 0.0;
  }
}

std::string instances_csv(const std::vector<WallInstance>& list) {
  std::string text =
      "id,kind,x_mm,y_mm,z_mm,inward_x,inward_y,inward_z,radius_mm,height_mm,region\n";
  for (const WallInstance& w : list)
    text += fmt::format("{},{},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{:.4f},{:.4f},{}\n", w.id,
                        instance_name(w.kind), w.centre_mm.x(), w.centre_mm.y(), w.centre_mm.z(),
                        w.inward.x(), w.inward.y(), w.inward.z(), w.radius_mm, w.height_mm,
                        region_name(w.region));
  return text;
}

}  // namespace rugae
