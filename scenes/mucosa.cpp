#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "core/check.h"
#include "core/float4.h"
#include "core/portable_math.h"
#include "core/random.h"
#include "scenes/instances.h"
#include "scenes/lattice_noise.h"
#include "scenes/noise_tile.h"
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
Float4 survives(Float4 footprint_mm, float size_mm) {
  const Float4 t = clamp01(splat(2.0f) - splat(4.0f / size_mm) * footprint_mm);
  return t * t * (splat(3.0f) - splat(2.0f) * t);
}

// Two rotations that turn the tiles against each other, so that their axes and periods never line
// up; their inverses take gradients back.
constexpr float kThird = 1.0f / 3.0f;
constexpr Turn kTurnA{{{0.6f, -0.8f, 0.0f}, {0.64f, 0.48f, -0.6f}, {0.48f, 0.36f, 0.8f}}};
constexpr Turn kTurnB{{{2 * kThird, -kThird, 2 * kThird},
                       {2 * kThird, 2 * kThird, -kThird},
                       {-kThird, 2 * kThird, 2 * kThird}}};

Float4x3 tangential(const Float4x3& g, const Float4x3& normal) {
  return g - normal * dot(normal, g);
}

// 0 below `from`, 1 above `to`, 3 t^2 - 2 t^3 between.
Float4 smooth_steps(float from, float to, Float4 x) {
  const Float4 t = clamp01((x - splat(from)) * splat(1.0f / (to - from)));
  return t * t * (splat(3.0f) - splat(2.0f) * t);
}

constexpr std::size_t kFour = 4;

}  // namespace

// The last place again where there are fewer than four.
struct Mucosa::FourPlaces {
  Float4x3 p, normal;
  Float4 footprint_mm, squamous;  // the latter a mask

  FourPlaces() {}  // filled by take
  void take(std::span<const MucosaPlace> places) {
    // A place is two registers: position and normal's x, and the rest.
    static_assert(sizeof(MucosaPlace) == 32 && offsetof(MucosaPlace, normal) == 12 &&
                  offsetof(MucosaPlace, region) == 24 && sizeof(Region) == 1 &&
                  offsetof(MucosaPlace, footprint_mm) == 28);
    const auto half = [&](std::size_t k, int which) {
      return _mm_loadu_ps(places[std::min(k, places.size() - 1)].rest_position_mm.data() +
                          4 * which);
    };
    const Float4x4 first = transposed(half(0, 0), half(1, 0), half(2, 0), half(3, 0));
    const Float4x4 second = transposed(half(0, 1), half(1, 1), half(2, 1), half(3, 1));
    p = first3(first);
    normal = {first.w, second.x, second.y};
    const __m128i region = _mm_and_si128(_mm_castps_si128(second.z), _mm_set1_epi32(0xff));
    squamous = _mm_castsi128_ps(
        _mm_cmpeq_epi32(region, _mm_set1_epi32(static_cast<int>(Region::oesophagus))));
    footprint_mm = second.w;
  }
};

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

// The slow layers of four places, and where the fine ones lie. A layer that shows at none of the
// four is not looked for.
struct Mucosa::Layers {
  FourPlaces at;
  Float4x4 blotch, mottle, tint;
  Float4 area_share, patch_share, pit_share, vessels_shown;
  bool area_shows, patch_shows, pit_shows, vessels_show;
  NoiseTile::Places area, patch, pit, first_vessel, second_vessel;

  Layers() {}  // filled by find_layers
};

void Mucosa::find_layers(Layers& l) const {
  const FourPlaces& at = l.at;
  const NoiseTile& smooth = tiles_->smooth;
  const NoiseTile& cells = tiles_->cells;
  const Float4x3 &p = at.p, pa = kTurnA * p, pb = kTurnB * p;
  // The warp bends every finer layer, so that no period of a tile is ever seen twice.
  l.blotch = smooth.fetch(pa * (1.0f / kBlotchMm));
  const Float4x3 warp = first3(l.blotch) * 1.5f;
  l.mottle = cells.fetch((pb + warp) * (1.0f / kMottleMm));
  l.tint = tint_ ? tint_->fetch(p) : Float4x4{splat(1.0f), splat(1.0f), splat(1.0f), splat(0.5f)};

  const auto find = [](const NoiseTile& tile, const Float4x3& where, NoiseTile::Places& found) {
    found = tile.locate(where);
    tile.prefetch(found);
  };
  const auto shows = [](Float4 share) { return any(above(share, _mm_setzero_ps())); };
  l.area_share = survives(at.footprint_mm, kAreaMm);
  l.patch_share = survives(at.footprint_mm, kPatchMm);
  l.pit_share = survives(at.footprint_mm, kFoveolaMm);
  // Vessels fade in and out over the wall, as they dive.
  l.vessels_shown = l.tint.w * clamp01(splat(0.35f) + splat(1.2f) * l.blotch.x);
  if ((l.area_shows = shows(l.area_share))) find(cells, (p + warp) * (1.0f / kAreaMm), l.area);
  if ((l.patch_shows = shows(l.patch_share)))
    find(smooth, (pb - warp) * (1.0f / kPatchMm), l.patch);
  if ((l.pit_shows = shows(l.pit_share))) find(smooth, (pa + warp) * (1.0f / kFoveolaMm), l.pit);
  if ((l.vessels_show = shows(l.vessels_shown))) {
    const Float4x3 bend = warp * 0.8f;
    find(smooth, (p + bend) * (1.0f / kVesselMm), l.first_vessel);
    find(smooth, (pb - bend) * (1.0f / kVesselMm), l.second_vessel);
  }
}

// Vessels of the submucosa run where the largest of three fields (two noises and 0) changes
// hands: lines that meet by threes, as branches do. The distance to such a line is difference /
// |gradient of the difference| along the wall.
Float4 Mucosa::vessels(const Layers& layers) const {
  const FourPlaces& at = layers.at;
  const Float4 zero = _mm_setzero_ps();
  const Float4x3 flat{zero, zero, zero};
  const Float4x4 first = tiles_->smooth.fetch(layers.first_vessel);
  const Float4x4 second = tiles_->smooth.fetch(layers.second_vessel);
  const Float4x3 first_slope = first3(first), second_slope = kTurnB.inverse() * first3(second);
  const Float4 second_is_higher = above(second.w, first.w);
  Float4 high = max(first.w, second.w), low = min(first.w, second.w);
  Float4x3 high_slope = select(second_is_higher, second_slope, first_slope),
           low_slope = select(second_is_higher, first_slope, second_slope);
  // 0 is the highest, or between the two
  const Float4 both_below = above(zero, high), zero_between = above(zero, low);
  low = select(both_below, high, max(low, zero));
  low_slope = select(both_below, high_slope, select(zero_between, flat, low_slope));
  high = max(high, zero);
  high_slope = select(both_below, flat, high_slope);

  const Float4x3 across = tangential(high_slope - low_slope, at.normal);
  const Float4 steep = _mm_sqrt_ps(dot(across, across) + splat(0.02f));
  // a line narrower than the pixel keeps its darkness times width
  const Float4 half = max(splat(kVesselHalfMm), splat(0.5f) * at.footprint_mm);
  const Float4 t = max(zero, splat(1.0f) - (high - low) * splat(kVesselMm / 2.5f) / (half * steep));
  // where the fields barely part, a vessel would be a blot
  return layers.vessels_shown * smooth_steps(0.3f, 0.9f, steep) * (splat(kVesselHalfMm) / half) *
         t * t * t;
}

void Mucosa::blend(const Layers& layers, std::span<MucosaSample> samples) const {
  const FourPlaces& at = layers.at;
  const NoiseTile& smooth = tiles_->smooth;
  const NoiseTile& cells = tiles_->cells;
  const Float4x4 &blotch = layers.blotch, &mottle = layers.mottle;
  const Float4 zero = _mm_setzero_ps(), one = splat(1.0f);

  // Furrows and tones: `blood` reddens (haemoglobin takes green and blue), `shade` darkens.
  Float4 blood = splat(1.5f) * blotch.w + splat(0.8f) * mottle.z;
  Float4 shade = splat(0.5f) * mottle.w;
  Float4x3 slope{zero, zero, zero};
  Float4 breaks = zero;
  if (layers.area_shows) {
    const Float4x4 area = cells.fetch(layers.area);
    blood = blood + layers.area_share * (splat(0.4f) * area.x + splat(0.25f) * area.y);
    shade = shade + layers.area_share * (splat(0.12f) * area.x + splat(0.2f) * area.z);
  }
  if (layers.patch_shows) {
    const Float4x4 patch = smooth.fetch(layers.patch);
    breaks = layers.patch_share * patch.w;
    shade = shade + splat(0.25f) * breaks;
    slope = (kTurnB.inverse() * first3(patch)) * (splat(kLongSlope) * layers.patch_share);
  }
  if (layers.pit_shows) {
    const Float4x4 pit = smooth.fetch(layers.pit);
    const Float4 tone = layers.pit_share * pit.w;
    shade = shade + splat(0.4f) * tone;
    blood = blood + splat(0.2f) * tone;
    slope = slope + (kTurnA.inverse() * first3(pit)) * (splat(kShortSlope) * layers.pit_share);
  }
  const auto lost = [one](float unit, Float4 share) {
    return splat(unit * unit) * (one - share * share);
  };
  const Float4 lost_slope =
      lost(kLongSlope, layers.patch_share) + lost(kShortSlope, layers.pit_share);
  const Float4 vessel = layers.vessels_show ? vessels(layers) : zero;

  // Absorption acts on each colour; the limits keep the albedo inside (0, 1) at any contrast.
  const auto contrast = splat(static_cast<float>(options_.mottle_contrast));
  blood = contrast * blood + splat(static_cast<float>(options_.vessel_contrast)) * vessel;
  shade = contrast * shade;
  const Float4 ochre = splat(0.5f) * contrast * blotch.y;
  const auto colour = [&](int c, Float4 tint, float reddens, float darkens, float ochres,
                          float squamous) {
    Float4 albedo = splat(base_albedo_[c]) * tint;
    // squamous, paler than gastric mucosa
    albedo = select(at.squamous, albedo * splat(0.8f) + splat(squamous), albedo);
    const Float4 toned =
        one - blood * splat(reddens) - shade * splat(darkens) + ochre * splat(ochres);
    return min(max(albedo * toned, splat(0.01f)), splat(0.95f));
  };

  // The wet layer: a film with holes, rippled; oil closes the holes and smooths the ripples.
  const Float4 film = splat(static_cast<float>(options_.wetness) - 0.32f) + splat(1.4f) * mottle.z +
                      splat(0.9f) * blotch.z + splat(1.2f) * breaks;
  const Float4 water = clamp01(film);
  const Float4 oily = splat(static_cast<float>(options_.oil)) *
                      clamp01(splat(0.75f) + splat(0.8f) * mottle.w + splat(0.4f) * blotch.w);
  const Float4 calm = one - splat(0.75f) * oily;
  const Float4 alpha = splat(kFilmAlpha) + splat(kOilAlpha - kFilmAlpha) * oily;
  const Float4x3 gradient = tangential(slope, at.normal) * calm;
  // Ripples finer than the pixel act as roughness: alpha^2 = alpha_0^2 + 2 sigma^2 of the slopes
  // lost (Olano and Baker, LEAN mapping, I3D 2010, doi:10.1145/1730804.1730834).
  const Float4 roughness =
      _mm_sqrt_ps(alpha * alpha + splat(2.0f * kGradientMeanSquare) * lost_slope * calm * calm);

  const Float4x4& tint = layers.tint;
  const Float4 each[] = {colour(0, tint.x, 0.16f, 0.8f, 0.0f, 0.16f),
                         colour(1, tint.y, 0.55f, 0.9f, 0.2f, 0.10f),
                         colour(2, tint.z, 0.50f, 0.95f, -0.8f, 0.07f),
                         roughness,
                         water + (one - water) * oily,
                         splat(kWaterF0) + splat(kOilF0 - kWaterF0) * oily,
                         gradient.x,
                         gradient.y,
                         gradient.z};
  alignas(16) float v[std::size(each)][kFour];
  for (std::size_t i = 0; i < std::size(each); ++i) _mm_store_ps(v[i], each[i]);
  for (std::size_t k = 0; k < samples.size(); ++k)
    samples[k] = {
        {v[0][k], v[1][k], v[2][k]}, v[3][k], v[4][k], v[5][k], {v[6][k], v[7][k], v[8][k]}};
}

void Mucosa::sample(std::span<const MucosaPlace> places, std::span<MucosaSample> samples) const {
  // Enough for memory to arrive meanwhile, few enough to stay in the nearest cache.
  constexpr std::size_t kTogether = 16;
  std::array<Layers, kTogether / kFour> layers;
  for (std::size_t begin = 0; begin < places.size(); begin += kTogether) {
    const auto batch = places.subspan(begin, std::min(kTogether, places.size() - begin));
    const auto four = [&batch](std::size_t k) {
      return batch.subspan(k, std::min(kFour, batch.size() - k));
    };
    for (std::size_t k = 0; k < batch.size(); k += kFour) {
      layers[k / kFour].at.take(four(k));
      find_layers(layers[k / kFour]);
    }
    for (std::size_t k = 0; k < batch.size(); k += kFour)
      blend(layers[k / kFour], samples.subspan(begin + k, four(k).size()));
  }
  if (!instances_) return;
  for (std::size_t k = 0; k < places.size(); ++k) {
    const Vec3 at_mm = places[k].rest_position_mm.cast<double>();
    const Instances::Hit hit = instances_->at(at_mm);
    if (!hit.instance) continue;
    paint_instance(hit, at_mm, places[k].normal, samples[k]);
    samples[k].instance = static_cast<std::uint8_t>(hit.instance->id);
  }
}

MucosaSample Mucosa::sample(const Vec3f& rest_position_mm, const Vec3f& normal, Region region,
                            float footprint_mm) const {
  const MucosaPlace place{rest_position_mm, normal, region, footprint_mm};
  MucosaSample sample;
  this->sample({&place, 1}, {&sample, 1});
  return sample;
}

}  // namespace rugae
