#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/check.h"
#include "core/random.h"
#include "scenes/instances.h"
#include "scenes/lanes.h"
#include "scenes/lattice_noise.h"
#include "scenes/noise_tile.h"
#include "scenes/portable_math.h"
#include "scenes/region_tint.h"
#include "scenes/scene.h"

namespace rugae {
namespace {

// Sizes of the layers of detail, mm a lattice cell; a feature is about one and a half cells wide.
constexpr float kBlotchMm = 23.0f;      // erythema, bile: colour over centimetres
constexpr float kMottleMm = 5.3f;       // brightness over millimetres
constexpr float kAreaMm = 2.7f;         // areae gastricae: 1 to 5 mm
constexpr float kPatchMm = 1.3f;        // blotches within an area, and the wet layer's long ripples
constexpr float kFoveolaMm = 0.42f;     // gastric pits: 0.2 to 0.5 mm apart, and the short ripples
constexpr float kVesselMm = 9.0f;       // from vessel to vessel of the submucosa
constexpr float kVesselHalfMm = 0.33f;  // half width, blurred by the mucosa above

constexpr float kLongSlope = 0.10f, kShortSlope = 0.075f;  // of the wet layer, for a unit gradient
constexpr float kGradientMeanSquare = 0.50f;               // of a tile's gradient, per component
constexpr float kFilmAlpha = 0.065f, kOilAlpha = 0.04f;    // GGX roughness of mucus and of oil
constexpr float kWaterF0 = 0.0207f;                        // ((n - 1) / (n + 1))^2 with n = 1.336
constexpr float kOilF0 = 0.0362f;                          // n = 1.47

// How much of detail of one cell's size survives a pixel: all of it while the pixel is under a
// quarter of the size, nothing once it is half of it.
float survives(float pixels_per_size_inverse) {
  const float t = std::clamp(2.0f - 4.0f * pixels_per_size_inverse, 0.0f, 1.0f);
  return t * t * (3.0f - 2.0f * t);
}

// Two rotations that turn the tiles against each other, so that their axes and periods never line
// up; their inverses (transposes) take gradients back.
struct Turns {
  Turn a, b, inverse_a, inverse_b;
};
Turns turns() {
  constexpr float k = 1.0f / 3.0f;
  return {{lanes(0.6f, 0.64f, 0.48f), lanes(-0.8f, 0.48f, 0.36f), lanes(0.0f, -0.6f, 0.8f)},
          {lanes(2 * k, 2 * k, -k), lanes(-k, 2 * k, 2 * k), lanes(2 * k, -k, 2 * k)},
          {lanes(0.6f, -0.8f, 0.0f), lanes(0.64f, 0.48f, -0.6f), lanes(0.48f, 0.36f, 0.8f)},
          {lanes(2 * k, -k, 2 * k), lanes(2 * k, 2 * k, -k), lanes(-k, 2 * k, 2 * k)}};
}

Lanes tangential(Lanes g, Lanes normal) { return g - normal * dot3(normal, g); }

}  // namespace

struct Mucosa::Tiles {
  NoiseTile smooth;  // gradient a cell, and value
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

Mucosa::Mucosa(const MucosaOptions& options, std::uint64_t seed,
               std::shared_ptr<const RegionTint> tint, std::shared_ptr<const Instances> instances)
    : options_(options),
      base_albedo_(options.base_albedo.cast<float>()),
      tint_(std::move(tint)),
      instances_(instances && !instances->list().empty() ? std::move(instances) : nullptr) {
  options.check("mucosa");
  const auto words = random_words(seed, Purpose::scene_mucosa, 0, 0);
  const auto smooth = [&](const Vec3& p) -> NoiseTile::Channels {
    const NoiseSample n = gradient_noise(p, words[0], NoiseTile::kCells);
    return {static_cast<float>(n.gradient.x()), static_cast<float>(n.gradient.y()),
            static_cast<float>(n.gradient.z()), static_cast<float>(n.value)};
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
  tiles_ = std::make_shared<const Tiles>(Tiles{NoiseTile(smooth, {2.5f, 2.5f, 2.5f, 1.2f}),
                                               NoiseTile(cells, {1.0f, 1.0f, 1.2f, 1.2f})});
}

// The slow layers of a place, and where the fine ones lie.
struct Mucosa::Layers {
  Lanes blotch, mottle, tint;
  float area_share, patch_share, pit_share, vessels_shown;
  NoiseTile::Place area, patch, pit, first_vessel, second_vessel;
};

Mucosa::Layers Mucosa::find_layers(const MucosaPlace& place) const {
  const NoiseTile& smooth = tiles_->smooth;
  const NoiseTile& cells = tiles_->cells;
  const Turns turn = turns();
  const Lanes p = lanes(place.rest_position_mm);
  const Lanes pa = turn.a * p, pb = turn.b * p;
  Layers l;
  // The warp bends every finer layer, so that no period of a tile is ever seen twice.
  l.blotch = smooth.fetch(pa * splat(1.0f / kBlotchMm));
  const Lanes warp = l.blotch * splat(1.5f);
  l.mottle = cells.fetch((pb + warp) * splat(1.0f / kMottleMm));
  l.tint = tint_ ? tint_->fetch(p) : lanes(1.0f, 1.0f, 1.0f, 0.5f);

  const auto find = [](const NoiseTile& tile, Lanes where, NoiseTile::Place& found) {
    found = tile.locate(where);
    NoiseTile::prefetch(found);
  };
  l.area_share = survives(place.footprint_mm * (1.0f / kAreaMm));
  if (l.area_share > 0.0f) find(cells, (p + warp) * splat(1.0f / kAreaMm), l.area);
  l.patch_share = survives(place.footprint_mm * (1.0f / kPatchMm));
  if (l.patch_share > 0.0f) find(smooth, (pb - warp) * splat(1.0f / kPatchMm), l.patch);
  l.pit_share = survives(place.footprint_mm * (1.0f / kFoveolaMm));
  if (l.pit_share > 0.0f) find(smooth, (pa + warp) * splat(1.0f / kFoveolaMm), l.pit);
  // Vessels fade in and out over the wall, as they dive.
  l.vessels_shown = lane<3>(l.tint) * std::clamp(0.35f + 1.2f * lane<0>(l.blotch), 0.0f, 1.0f);
  if (l.vessels_shown > 0.0f) {
    const Lanes bend = warp * splat(0.8f);
    find(smooth, (p + bend) * splat(1.0f / kVesselMm), l.first_vessel);
    find(smooth, (pb - bend) * splat(1.0f / kVesselMm), l.second_vessel);
  }
  return l;
}

MucosaSample Mucosa::blend(const MucosaPlace& place, const Layers& layers) const {
  const NoiseTile& smooth = tiles_->smooth;
  const NoiseTile& cells = tiles_->cells;
  const Turns turn = turns();
  const Lanes n = lanes(place.normal), blotch = layers.blotch, mottle = layers.mottle;
  const float blotch_tone = lane<3>(blotch), mottle_tone = lane<2>(mottle);

  // Furrows and tones: `blood` reddens (haemoglobin takes green and blue), `shade` darkens.
  const float contrast = static_cast<float>(options_.mottle_contrast);
  float blood = 1.5f * blotch_tone + 0.8f * mottle_tone;
  float shade = 0.5f * lane<3>(mottle);
  Lanes slope = _mm_setzero_ps();
  float lost_slope = 0.0f, breaks = 0.0f;

  if (const float area_share = layers.area_share; area_share > 0.0f) {
    const Lanes area = cells.fetch(layers.area);
    blood += area_share * (0.4f * lane<0>(area) + 0.25f * lane<1>(area));
    shade += area_share * (0.12f * lane<0>(area) + 0.2f * lane<2>(area));
  }
  const float patch_share = layers.patch_share;
  if (patch_share > 0.0f) {
    const Lanes patch = smooth.fetch(layers.patch);
    shade += 0.25f * patch_share * lane<3>(patch);
    breaks = patch_share * lane<3>(patch);
    slope = turn.inverse_b * patch * splat(kLongSlope * patch_share);
  }
  lost_slope += kLongSlope * kLongSlope * (1.0f - patch_share * patch_share);
  const float pit_share = layers.pit_share;
  if (pit_share > 0.0f) {
    const Lanes pit = smooth.fetch(layers.pit);
    shade += 0.4f * pit_share * lane<3>(pit);
    blood += 0.2f * pit_share * lane<3>(pit);
    slope = slope + turn.inverse_a * pit * splat(kShortSlope * pit_share);
  }
  lost_slope += kShortSlope * kShortSlope * (1.0f - pit_share * pit_share);

  // Vessels of the submucosa run where the largest of three fields (two noises and 0) changes
  // hands: lines that meet by threes, as branches do. The distance to such a line is difference /
  // |gradient of the difference| along the wall.
  float vessels = 0.0f;
  if (const float shown = layers.vessels_shown; shown > 0.0f) {
    const Lanes first = smooth.fetch(layers.first_vessel);
    const Lanes second = smooth.fetch(layers.second_vessel);
    float high = lane<3>(first), low = lane<3>(second);
    Lanes high_slope = first, low_slope = turn.inverse_b * second;
    if (high < low) {
      std::swap(high, low);
      std::swap(high_slope, low_slope);
    }
    if (high < 0.0f) {
      low = std::exchange(high, 0.0f);
      low_slope = std::exchange(high_slope, _mm_setzero_ps());
    } else if (low < 0.0f) {
      low = 0.0f;
      low_slope = _mm_setzero_ps();
    }
    const Lanes across = tangential(high_slope - low_slope, n);
    const float steep = std::sqrt(lane<0>(dot3(across, across)) + 0.02f);
    // a line narrower than the pixel keeps its darkness times width
    const float half = std::max(kVesselHalfMm, 0.5f * place.footprint_mm);
    const float t = 1.0f - (high - low) * kVesselMm / (2.5f * half * steep);
    // where the fields barely part, a vessel would be a blot
    if (t > 0.0f)
      vessels = shown * smooth_step(0.3f, 0.9f, steep) * (kVesselHalfMm / half) * t * t * t;
  }

  // Absorption acts on each colour; the limits keep the albedo inside (0, 1) at any contrast.
  MucosaSample out;
  blood = contrast * blood + static_cast<float>(options_.vessel_contrast) * vessels;
  shade *= contrast;
  const float ochre = 0.5f * contrast * lane<1>(blotch);
  const Lanes toned = splat(1.0f) - splat(blood) * lanes(0.16f, 0.55f, 0.50f) -
                      splat(shade) * lanes(0.8f, 0.9f, 0.95f) +
                      splat(ochre) * lanes(0.0f, 0.2f, -0.8f);
  Lanes albedo = lanes(base_albedo_) * layers.tint;
  if (place.region == Region::oesophagus)  // squamous, paler than gastric mucosa
    albedo = albedo * splat(0.8f) + lanes(0.16f, 0.10f, 0.07f);
  out.albedo = vec3(_mm_min_ps(_mm_max_ps(albedo * toned, splat(0.01f)), splat(0.95f)));

  // The wet layer: a film with holes, rippled; oil closes the holes and smooths the ripples.
  const float film = static_cast<float>(options_.wetness) - 0.32f + 1.4f * mottle_tone +
                     0.9f * lane<2>(blotch) + 1.2f * breaks;
  const float water = std::clamp(film, 0.0f, 1.0f);
  const float oily = static_cast<float>(options_.oil) *
                     std::clamp(0.75f + 0.8f * lane<3>(mottle) + 0.4f * blotch_tone, 0.0f, 1.0f);
  const float calm = 1.0f - 0.75f * oily;
  out.coverage = water + (1.0f - water) * oily;
  out.f0 = kWaterF0 + (kOilF0 - kWaterF0) * oily;
  const float alpha = kFilmAlpha + (kOilAlpha - kFilmAlpha) * oily;
  // Ripples finer than the pixel act as roughness: alpha^2 = alpha_0^2 + 2 sigma^2 of the slopes
  // lost (Olano and Baker, LEAN mapping, I3D 2010, doi:10.1145/1730804.1730834).
  out.roughness = std::sqrt(alpha * alpha + 2.0f * kGradientMeanSquare * lost_slope * calm * calm);
  out.coat_gradient = vec3(tangential(slope, n) * splat(calm));
  if (instances_) {
    const Vec3 at_mm = place.rest_position_mm.cast<double>();
    if (const Instances::Hit hit = instances_->at(at_mm); hit.instance) {
      paint_instance(hit, at_mm, place.normal, out);
      out.instance = static_cast<std::uint8_t>(hit.instance->id);
    }
  }
  return out;
}

void Mucosa::sample(std::span<const MucosaPlace> places, std::span<MucosaSample> samples) const {
  // Enough for memory to arrive meanwhile, few enough to stay in the nearest cache.
  constexpr std::size_t kTogether = 16;
  std::array<Layers, kTogether> layers;
  for (std::size_t begin = 0; begin < places.size(); begin += kTogether) {
    const std::size_t count = std::min(kTogether, places.size() - begin);
    for (std::size_t k = 0; k < count; ++k) layers[k] = find_layers(places[begin + k]);
    for (std::size_t k = 0; k < count; ++k)
      samples[begin + k] = blend(places[begin + k], layers[k]);
  }
}

MucosaSample Mucosa::sample(const Vec3f& rest_position_mm, const Vec3f& normal, Region region,
                            float footprint_mm) const {
  const MucosaPlace place{rest_position_mm, normal, region, footprint_mm};
  return blend(place, find_layers(place));
}

}  // namespace rugae
