#include "scenes/deformation.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "core/fields.h"

namespace rugae {
namespace {

// The bump's half width over its width at half height: (1 - x^2)^3 = 1/2 at x^2 = 1 - 2^(-1/3).
constexpr double kSupport = 1.1008316;  // 0.5 / sqrt(1 - 2^(-1/3))

// (1 - x^2)^3 for |x| < 1: two continuous derivatives, the third is bounded.
double bump(double x) {
  const double a = 1.0 - x * x;
  return a > 0.0 ? a * a * a : 0.0;
}

// 0 below `from`, 1 above `to`, 6 t^5 - 15 t^4 + 10 t^3 between: two continuous derivatives.
double smoother_step(double from, double to, double x) {
  const double t = std::min(1.0, std::max(0.0, (x - from) / (to - from)));
  return t * t * t * (10.0 + t * (6.0 * t - 15.0));
}

// Turns since the nearest whole one, -1/2 to 1/2.
double phase_of(double turns) { return turns - std::floor(turns + 0.5); }

// What the motion knows of each vertex.
struct MovingVertex {
  Vec3 rest_mm;
  Vec3 squeeze_mm;     // the displacement under a crest
  double phase_turns;  // of the wave: how many waves ago the crest of time 0 was here
  double sway = 0.0;   // share of the sway
};

struct Motion {
  std::vector<MovingVertex> vertices;
  double waves_hz = 0.0, apart_mm = 0.0, width_mm = 0.0, breaths_hz = 0.0;
  Vec3 sway_mm = Vec3::Zero();

  void move(double time_s, std::vector<Vec3>& moved_mm) const {
    moved_mm.resize(vertices.size());
    const double waves = time_s * waves_hz;
    // longer in expiration than in inspiration, as breath is
    const double breath = bump(2.0 * phase_of(time_s * breaths_hz)) - 0.5;
    const Vec3 swayed_mm = breath * sway_mm;
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, vertices.size(), 4096), [&](const auto& range) {
          for (std::size_t v = range.begin(); v < range.end(); ++v) {
            const MovingVertex& at = vertices[v];
            const double off_mm = apart_mm * phase_of(at.phase_turns - waves);
            moved_mm[v] = at.rest_mm + contraction_profile(off_mm, width_mm) * at.squeeze_mm +
                          at.sway * swayed_mm;
          }
        });
  }
};

}  // namespace

template <typename Visitor>
void fields(Visitor& v, DeformationOptions& o) {
  v.flag("peristalsis", o.peristalsis);
  v.number("waves_per_minute", o.waves_per_minute, 0.5, 12.0);
  v.number("speed_mm_s", o.speed_mm_s, 0.2, 20.0);
  v.number("amplitude_mm", o.amplitude_mm, 0.0, 20.0);
  v.number("occlusion", o.occlusion, 0.0, 0.9);
  v.number("width_mm", o.width_mm, 5.0, 100.0);
  v.flag("breathing", o.breathing);
  v.number("breaths_per_minute", o.breaths_per_minute, 1.0, 60.0);
  v.number("sway_mm", o.sway_mm, 0.0, 30.0);
}

void DeformationOptions::check(const std::string& where) const {
  check_fields(*this, where.c_str());
  const double apart_mm = speed_mm_s * 60.0 / waves_per_minute;
  rugae::check(2.0 * kSupport * width_mm <= apart_mm,
               "{}: width_mm is {}, expected at most {:.1f} where waves are {:.1f} mm apart "
               "(speed_mm_s {}, waves_per_minute {})",
               where, width_mm, apart_mm / (2.0 * kSupport), apart_mm, speed_mm_s,
               waves_per_minute);
}

void read_deformation(YamlReader yaml, DeformationOptions& options) {
  read_fields(std::move(yaml), options);
}

std::vector<Field> list_deformation() { return list_of_fields(DeformationOptions{}); }

std::string deformation_yaml(const DeformationOptions& options) {
  return json_of_fields(options).dump();
}

double contraction_profile(double offset_mm, double width_mm) {
  return bump(offset_mm / (kSupport * width_mm));
}

// min(amplitude, occlusion * off_axis), rounded where the two meet: for |a - b| < k,
// min(a, b) - (k - |a - b|)^2 / (4 k), with k a fifth of the amplitude.
double contraction_depth_mm(const DeformationOptions& options, double off_axis_mm,
                            double strength) {
  const double a = options.amplitude_mm, b = options.occlusion * off_axis_mm, k = 0.2 * a;
  const double over = std::max(0.0, k - std::abs(a - b));
  const double least = std::min(a, b) - (over > 0.0 ? over * over / (4.0 * k) : 0.0);
  return strength * std::max(0.0, least);
}

// Peristalsis: a ring at s mm along the axis draws together by the depth d,
// p' = p - d profile(s - crest) (p - axis(s)) / |p - axis(s)|, and the crest moves along s at
// constant speed. Breathing: a translation along the upper half of the axis, whole at its beginning
// and half at its end (the duodenum is held by the back wall of the belly).
OrganMotion make_motion(const DeformationOptions& options, const PeristalsisZone& zone,
                        const OrganAxis& axis, const std::vector<Vec3>& rest_positions_mm) {
  if (!options.peristalsis && !options.breathing) return {};
  const auto motion = std::make_shared<Motion>();
  motion->waves_hz = options.waves_per_minute / 60.0;
  motion->apart_mm = options.speed_mm_s / motion->waves_hz;
  motion->width_mm = options.width_mm;
  motion->breaths_hz = options.breaths_per_minute / 60.0;
  if (options.breathing) motion->sway_mm = options.sway_mm * axis.direction_to(0.5);
  motion->vertices.resize(rest_positions_mm.size());
  tbb::parallel_for(std::size_t{0}, rest_positions_mm.size(), [&](std::size_t v) {
    const Vec3& p = rest_positions_mm[v];
    const AxisPoint at = axis.locate(p);
    const double rise = smoother_step(zone.rise_from_mm, zone.rise_to_mm, at.s_mm);
    const double fall = smoother_step(zone.fall_from_mm, zone.fall_to_mm, at.s_mm);
    const double strength = options.peristalsis ? rise * (1.0 - fall) : 0.0;
    const Vec3 off_axis_mm = at.greater_mm * at.greater + at.side_mm * at.side;
    const double off_mm = off_axis_mm.norm();
    const double depth_mm = contraction_depth_mm(options, off_mm, strength);
    motion->vertices[v] = {p, -depth_mm / std::max(off_mm, 1e-9) * off_axis_mm,
                           (at.s_mm - zone.rise_from_mm) / motion->apart_mm,
                           1.0 - 0.5 * smoother_step(0.0, axis.length_mm(), at.s_mm)};
  });
  double squeeze_mm = 0.0;
  for (const MovingVertex& v : motion->vertices)
    squeeze_mm = std::max(squeeze_mm, v.squeeze_mm.norm());
  return {[motion](double time_s, std::vector<Vec3>& moved_mm) { motion->move(time_s, moved_mm); },
          squeeze_mm + 0.5 * motion->sway_mm.norm()};
}

}  // namespace rugae
