// What lesions and objects look like. Colours are linear RGB and assumed after endoscopic
// descriptions: a fibrin base is whitish yellow, the rim of an ulcer hyperaemic, an angiectasia
// bright red and fern-like, fresh blood dark red and shining.

#include <algorithm>
#include <cmath>

#include "core/portable_math.h"
#include "scenes/instances.h"
#include "scenes/lattice_noise.h"

namespace rugae {
namespace {

const Vec3f kFibrin(0.56f, 0.38f, 0.17f), kBlood(0.26f, 0.018f, 0.012f),
    kMucus(0.64f, 0.44f, 0.27f), kFoam(0.70f, 0.60f, 0.48f);
const Vec3f kHyperaemia(0.95f, 0.52f, 0.52f);  // a factor

void blend(MucosaSample& s, const Vec3f& albedo, float share) {
  s.albedo += share * (albedo - s.albedo);
}
void redden(MucosaSample& s, float share) {
  s.albedo = s.albedo.cwiseProduct(Vec3f::Ones() + share * (kHyperaemia - Vec3f::Ones()));
}
// A film thick enough to hide the ripples below it.
void flood(MucosaSample& s, float share, float roughness) {
  s.coverage += share * (1.0f - s.coverage);
  s.roughness += share * (roughness - s.roughness);
  s.coat_gradient *= 1.0f - 0.8f * share;
}

// (1 - t^2)^2 of a ring around `middle`.
float ring(float rho, float middle, float half_width) {
  const float t = (rho - middle) / half_width;
  return std::abs(t) < 1.0f ? (1.0f - t * t) * (1.0f - t * t) : 0.0f;
}

// Dilated vessels run where a noise stretched from the middle outward is near zero.
float fern(const Instances::Hit& hit, const Vec3& p_mm) {
  const WallInstance& w = *hit.instance;
  const Vec3 arms = 2.6 * hit.outward + 0.25 * (p_mm - w.centre_mm);
  const auto line = static_cast<float>(std::abs(gradient_noise(arms, w.outline + 1).value));
  const auto rho = static_cast<float>(hit.rho);
  const float core = smooth_step(0.5f, 0.15f, rho);
  return std::max(core, smooth_step(0.22f, 0.06f, line) * smooth_step(1.0f, 0.75f, rho));
}

// A thin film blown to a cap: steep at its foot, so that it shines where its side faces the light,
// and looks whitish where the eye passes along it.
void blow_bubble(const Instances::Hit& hit, const Vec3f& normal, MucosaSample& s) {
  constexpr float kSteepest = 1.2f;
  constexpr float kTwoFaces = 2.0f;  // light is reflected going in and coming out
  const auto rho = static_cast<float>(hit.rho);
  const float slope = kSteepest * rho / std::sqrt(1.0f + 0.3f - rho * rho);
  const float foot = smooth_step(1.0f, 0.93f, rho);
  blend(s, kFoam, 0.5f * ring(rho, 0.9f, 0.1f));
  s.albedo *= 1.0f - 0.35f * ring(rho, 0.72f, 0.2f);
  flood(s, foot, 0.05f);
  s.f0 += foot * (kTwoFaces - 1.0f) * s.f0;
  const Vec3f g = -std::min(slope, kSteepest) * foot * hit.outward.cast<float>();
  s.coat_gradient += g - normal * normal.dot(g);
}

}  // namespace

void paint_instance(const Instances::Hit& hit, const Vec3& p_mm, const Vec3f& normal,
                    MucosaSample& s) {
  const auto rho = static_cast<float>(hit.rho);
  const WallInstance& w = *hit.instance;
  const auto grain = static_cast<float>(gradient_noise(1.3 * p_mm, w.outline + 2).value);
  const float inside = smooth_step(1.0f, 0.85f, rho);
  switch (w.kind) {
    case InstanceKind::polyp:
      redden(s, inside * (0.35f + 0.25f * grain));
      break;
    case InstanceKind::ulcer:
      redden(s, 0.7f * smooth_step(1.0f, 0.6f, rho));
      blend(s, kFibrin * (1.0f + 0.15f * grain),
            0.9f * smooth_step(0.72f, 0.48f, rho + 0.12f * grain));
      break;
    case InstanceKind::erosion:
      redden(s, 0.9f * smooth_step(1.0f, 0.6f, rho));
      blend(s, kFibrin, 0.75f * smooth_step(0.45f, 0.25f, rho + 0.1f * grain));
      break;
    case InstanceKind::bleeding: {
      const float blood = smooth_step(1.0f, 0.8f, rho);
      blend(s, kBlood * (1.0f + 0.3f * grain), 0.96f * blood);
      flood(s, blood, 0.05f);
      break;
    }
    case InstanceKind::angiectasia: {
      const float red = fern(hit, p_mm);
      redden(s, 0.3f * inside);
      blend(s, Vec3f(0.50f, 0.05f, 0.035f), 0.8f * red);
      break;
    }
    case InstanceKind::debris: {
      // food from green to brown, by lump
      const float brown = static_cast<float>(w.outline >> 8) * 0x1p-24f;
      const Vec3f food = Vec3f(0.36f, 0.28f, 0.08f) + brown * Vec3f(0.06f, -0.13f, -0.03f);
      blend(s, food * (1.0f + 0.5f * grain), 0.95f * smooth_step(1.0f, 0.9f, rho));
      s.roughness = std::max(s.roughness, 0.25f);
      break;
    }
    case InstanceKind::bubble:
      blow_bubble(hit, normal, s);
      break;
    case InstanceKind::mucus: {
      const float strand = static_cast<float>(
          gradient_noise(p_mm.cwiseProduct(Vec3(0.5, 0.35, 0.18)), w.outline + 3).value);
      const float thick =
          (1.0f - rho * rho) * std::clamp(0.5f + 0.8f * strand + 0.2f * grain, 0.0f, 1.0f);
      blend(s, kMucus, 0.8f * thick);
      flood(s, inside * std::min(1.0f, 0.4f + thick), 0.07f);
      break;
    }
  }
  s.albedo = s.albedo.cwiseMax(0.005f).cwiseMin(0.95f);
}

}  // namespace rugae
