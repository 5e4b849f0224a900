#include <algorithm>
#include <cmath>

#include "core/check.h"
#include "core/random.h"
#include "scenes/lattice_noise.h"
#include "scenes/noise_tile.h"
#include "scenes/portable_math.h"
#include "scenes/scene.h"

namespace rugae {
namespace {

// Sizes of the layers of detail, mm a lattice cell; a feature is about one and a half cells wide.
constexpr float kBlotchMm = 23.0f;   // erythema, bile: colour over centimetres
constexpr float kMottleMm = 5.3f;    // brightness over millimetres
constexpr float kAreaMm = 2.3f;      // areae gastricae: 1 to 5 mm
constexpr float kPatchMm = 1.3f;     // blotches within an area, and the wet layer's long ripples
constexpr float kFoveolaMm = 0.42f;  // gastric pits: 0.2 to 0.5 mm apart, and the short ripples
constexpr float kTreeMm = 8.0f;      // vessels of the submucosa
constexpr float kTwigMm = 2.6f;      // vessels of the mucosa
constexpr float kTreeHalfMm = 0.28f, kTwigHalfMm = 0.11f;  // half widths of the vessels

constexpr float kLongSlope = 0.16f, kShortSlope = 0.13f;  // of the wet layer, for a unit gradient
constexpr float kGradientMeanSquare = 0.50f;              // of a tile's gradient, per component
constexpr float kWaterF0 = 0.0207f;                       // ((n - 1) / (n + 1))^2 with n = 1.336
constexpr float kOilF0 = 0.0362f;                         // n = 1.47

// How much of detail of one cell's size survives a pixel: all of it while the pixel is under a
// quarter of the size, nothing once it is half of it.
float survives(float size_mm, float footprint_mm) {
  const float t = std::clamp(2.0f - 4.0f * footprint_mm / size_mm, 0.0f, 1.0f);
  return t * t * (3.0f - 2.0f * t);
}

// Three of the many rotations that turn the tiles against each other, so that their axes and
// periods never line up: rational, hence exact enough in single precision.
Vec3f turn_a(const Vec3f& p) {
  return {0.6f * p.x() - 0.8f * p.y(), 0.64f * p.x() + 0.48f * p.y() - 0.6f * p.z(),
          0.48f * p.x() + 0.36f * p.y() + 0.8f * p.z()};
}
const Vec3f turn_b(const Vec3f& p) {
  constexpr float k = 1.0f / 3.0f;
  return {k * (2.0f * p.x() - p.y() + 2.0f * p.z()), k * (2.0f * p.x() + 2.0f * p.y() - p.z()),
          k * (-p.x() + 2.0f * p.y() + 2.0f * p.z())};
}
// The transpose takes a gradient back.
Vec3f unturn_a(const Vec3f& g) {
  return {0.6f * g.x() + 0.64f * g.y() + 0.48f * g.z(),
          -0.8f * g.x() + 0.48f * g.y() + 0.36f * g.z(), -0.6f * g.y() + 0.8f * g.z()};
}
Vec3f unturn_b(const Vec3f& g) {
  constexpr float k = 1.0f / 3.0f;
  return {k * (2.0f * g.x() + 2.0f * g.y() - g.z()), k * (-g.x() + 2.0f * g.y() + 2.0f * g.z()),
          k * (2.0f * g.x() - g.y() + 2.0f * g.z())};
}

Vec3f gradient_of(const NoiseTile::Channels& c) { return {c[1], c[2], c[3]}; }
Vec3f tangential(const Vec3f& g, const Vec3f& normal) { return g - normal * normal.dot(g); }

}  // namespace

struct Mucosa::Tiles {
  NoiseTile smooth;  // value, and its gradient a cell
  NoiseTile cells;   // furrows between cells (1) to their middle (0), a tone a cell, two noises
};

void MucosaOptions::check(const std::string& where) const {
  for (int c = 0; c < 3; ++c)
    rugae::check(base_albedo[c] > 0.0 && base_albedo[c] < 1.0,
                 "{}: base_albedo is [{}, {}, {}], expected values between 0 and 1", where,
                 base_albedo.x(), base_albedo.y(), base_albedo.z());
  const auto share = [&](const char* name, double value) {
    rugae::check(value >= 0.0 && value <= 1.0, "{}: {} is {}, expected 0 to 1", where, name, value);
  };
  share("vessel_contrast", vessel_contrast);
  share("mottle_contrast", mottle_contrast);
  share("wetness", wetness);
  share("oil", oil);
}

Mucosa::Mucosa(const MucosaOptions& options, std::uint64_t seed)
    : options_(options), base_albedo_(options.base_albedo.cast<float>()) {
  options.check("mucosa");
  const auto words = random_words(seed, Purpose::scene_mucosa, 0, 0);
  const auto smooth = [&](const Vec3& p) -> NoiseTile::Channels {
    const NoiseSample n = gradient_noise(p, words[0], NoiseTile::kCells);
    return {static_cast<float>(n.value), static_cast<float>(n.gradient.x()),
            static_cast<float>(n.gradient.y()), static_cast<float>(n.gradient.z())};
  };
  const auto cells = [&](const Vec3& p) -> NoiseTile::Channels {
    const CellSample c = cell_noise(p, words[1], NoiseTile::kCells);
    const double furrow = 1.0 - smooth_step(0.0, 0.35, c.second - c.nearest);
    // the tone of a cell fades into the furrow around it
    const double tone = (static_cast<double>(c.id >> 8) * 0x1p-23 - 1.0) * (1.0 - furrow);
    return {static_cast<float>(furrow), static_cast<float>(tone),
            static_cast<float>(gradient_noise(p, words[2], NoiseTile::kCells).value),
            static_cast<float>(gradient_noise(p, words[3], NoiseTile::kCells).value)};
  };
  tiles_ = std::make_shared<const Tiles>(Tiles{NoiseTile(smooth, {1.2f, 2.5f, 2.5f, 2.5f}),
                                               NoiseTile(cells, {1.0f, 1.0f, 1.2f, 1.2f})});
}

MucosaSample Mucosa::sample(const Vec3f& rest_position_mm, const Vec3f& normal, Region region,
                            float footprint_mm) const {
  const NoiseTile& smooth = tiles_->smooth;
  const NoiseTile& cells = tiles_->cells;
  const Vec3f& p = rest_position_mm;
  const Vec3f pa = turn_a(p), pb = turn_b(p);

  // Slow layers. The warp bends every finer layer, so that no period of a tile is ever seen twice.
  const auto blotch = smooth.fetch(pa * (1.0f / kBlotchMm));
  const Vec3f warp = gradient_of(blotch) * 1.5f;
  const auto mottle = cells.fetch((pb + warp) * (1.0f / kMottleMm));

  // Furrows and tones: `blood` reddens (haemoglobin takes green and blue), `shade` darkens.
  const float contrast = static_cast<float>(options_.mottle_contrast);
  float blood = 0.9f * contrast * blotch[0] + 0.7f * contrast * mottle[2];
  float shade = 0.8f * contrast * mottle[3];
  Vec3f slope = Vec3f::Zero();
  float lost_slope = 0.0f;

  const float area_share = survives(kAreaMm, footprint_mm);
  if (area_share > 0.0f) {
    const auto area = cells.fetch((p + warp) * (1.0f / kAreaMm));
    blood += contrast * area_share * (0.7f * area[0] + 0.35f * area[1]);
    shade += contrast * area_share * (0.25f * area[0] + 0.3f * area[2]);
  }
  const float patch_share = survives(kPatchMm, footprint_mm);
  if (patch_share > 0.0f) {
    const auto patch = smooth.fetch((pb - warp) * (1.0f / kPatchMm));
    shade += 0.5f * contrast * patch_share * patch[0];
    slope += (kLongSlope * patch_share) * unturn_b(gradient_of(patch));
  }
  lost_slope += kLongSlope * kLongSlope * (1.0f - patch_share * patch_share);
  const float pit_share = survives(kFoveolaMm, footprint_mm);
  if (pit_share > 0.0f) {
    const auto pit = smooth.fetch((pa + warp) * (1.0f / kFoveolaMm));
    shade += 0.6f * contrast * pit_share * pit[0];
    blood += 0.3f * contrast * pit_share * pit[0];
    slope += (kShortSlope * pit_share) * unturn_a(gradient_of(pit));
  }
  lost_slope += kShortSlope * kShortSlope * (1.0f - pit_share * pit_share);

  // Vessels run where a noise crosses zero; the distance to the line is |n| / |grad n| along the
  // wall. Each layer fades in and out over the wall, as vessels dive.
  const float vessel_contrast = static_cast<float>(options_.vessel_contrast);
  const auto vessel = [&](const Vec3f& q, float cell_mm, float half_mm, float depth) {
    const auto n = smooth.fetch(q * (1.0f / cell_mm));
    const float steep = std::sqrt(tangential(gradient_of(n), normal).squaredNorm() + 0.02f);
    const float distance = std::abs(n[0]) * cell_mm / steep;
    // a line narrower than the pixel keeps its darkness times width
    const float half = std::max(half_mm, 0.5f * footprint_mm);
    const float t = std::max(0.0f, 1.0f - distance / (1.6f * half));
    // closed loops, where the noise barely crosses zero, fade: vessels do not end in rings
    const float drawn = smooth_step(0.35f, 0.8f, steep);
    return drawn * depth * (half_mm / half) * t * t * (3.0f - 2.0f * t);
  };
  const float tree_depth = std::clamp(0.35f + 0.9f * blotch[1], 0.0f, 1.0f);
  float vessels = 0.0f;
  if (tree_depth > 0.0f) vessels += vessel(p + 0.6f * warp, kTreeMm, kTreeHalfMm, tree_depth);
  const float twig_depth =
      std::clamp(0.4f + 0.8f * mottle[2], 0.0f, 1.0f) * survives(kTwigMm, footprint_mm);
  if (twig_depth > 0.0f)
    vessels += 0.7f * vessel(pa - 0.4f * warp, kTwigMm, kTwigHalfMm, twig_depth);

  MucosaSample out;
  blood += vessel_contrast * 2.2f * vessels;
  const float ochre = 0.35f * contrast * blotch[2];
  // Absorption acts on each colour; the clamp keeps the albedo inside (0, 1) whatever the contrast.
  const Vec3f toned(1.0f - 0.16f * blood - 0.8f * shade,
                    1.0f - 0.55f * blood - 0.9f * shade + 0.2f * ochre,
                    1.0f - 0.50f * blood - 0.95f * shade - 0.8f * ochre);
  Vec3f albedo = base_albedo_;
  if (region == Region::oesophagus)  // squamous, paler than gastric mucosa
    albedo = 0.75f * albedo + Vec3f::Constant(0.16f);
  for (int c = 0; c < 3; ++c) out.albedo[c] = std::clamp(albedo[c] * toned[c], 0.01f, 0.95f);

  // The wet layer: a film with holes, rippled; oil closes the holes and smooths the ripples.
  const float oil = static_cast<float>(options_.oil);
  const float film = static_cast<float>(options_.wetness) + 0.5f * mottle[2] + 0.35f * blotch[3];
  const float water = std::clamp(film, 0.0f, 1.0f);
  const float oily = oil * std::clamp(0.75f + 0.8f * mottle[3] + 0.4f * blotch[0], 0.0f, 1.0f);
  const float calm = 1.0f - 0.75f * oily;
  out.coverage = water + (1.0f - water) * oily;
  out.f0 = kWaterF0 + (kOilF0 - kWaterF0) * oily;
  const float alpha = 0.16f - 0.09f * oily;
  // Ripples finer than the pixel act as roughness: alpha^2 = alpha_0^2 + 2 sigma^2 of the slopes
  // lost (Olano and Baker, LEAN mapping, I3D 2010, doi:10.1145/1730804.1730834).
  out.roughness = std::sqrt(alpha * alpha + 2.0f * kGradientMeanSquare * lost_slope * calm * calm);
  out.coat_gradient = tangential(slope, normal) * calm;
  return out;
}

}  // namespace rugae
