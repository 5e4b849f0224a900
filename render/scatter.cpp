#include "render/scatter.h"

#include <algorithm>
#include <cmath>

#include "core/portable_math.h"

namespace rugae {
namespace {

// Axes with `z` as the third (Duff et al., Building an orthonormal basis, revisited, JCGT 6(1),
// 2017): no branch but the sign, so it is the same everywhere.
Mat3 world_from_local(const Vec3& z) {
  const double sign = std::copysign(1.0, z.z()), a = -1.0 / (sign + z.z()), b = z.x() * z.y() * a;
  Mat3 axes;
  axes.col(0) = Vec3(1.0 + sign * z.x() * z.x() * a, sign * b, -sign * z.x());
  axes.col(1) = Vec3(b, sign + z.y() * z.y() * a, -z.y());
  axes.col(2) = z;
  return axes;
}

// The share of samples that go to the wet layer: what it reflects of what comes back in all, kept
// away from 0 and 1 so that neither layer is ever sampled badly.
double coat_share(const ShadedPoint& p, const Vec3& out) {
  constexpr double kLeast = 0.1, kMost = 0.9;
  if (!(p.coat.coverage > 0.0)) return 0.0;
  const double cosine = std::clamp(out.dot(p.coat_normal), 0.0, 1.0);
  const double coat = p.coat.coverage * schlick_fresnel(cosine, p.coat.f0);
  const double wall = (1.0 - coat) * p.albedo.maxCoeff();
  return std::clamp(coat / (coat + wall), kLeast, kMost);
}

}  // namespace

// n_coat = normalize(n - g_tangential), g the slope of the wet layer's height.
ShadedPoint::ShadedPoint(const Vec3& geometric, const Vec3f& shading, const MucosaSample& material,
                         const Vec3& direction_world)
    : geometric_normal(geometric),
      normal(shading.cast<double>().normalized()),
      coat{material.roughness, material.coverage, material.f0},
      albedo(material.albedo.cast<double>()) {
  if (geometric_normal.dot(direction_world) > 0.0) geometric_normal = -geometric_normal;
  const Vec3 gradient = material.coat_gradient.cast<double>();
  coat_normal = (normal - (gradient - normal * normal.dot(gradient))).normalized();
}

Scattered scatter(const ShadedPoint& p, const Vec3& in, const Vec3& out) {
  const double cos_in = in.dot(p.normal), cos_out = out.dot(p.normal);
  if (!(cos_in > 0.0) || !(cos_out > 0.0) || !(in.dot(p.geometric_normal) > 0.0)) return {};
  Scattered result;
  const auto through = [&p](double cosine) {
    return 1.0 - p.coat.coverage * schlick_fresnel(cosine, p.coat.f0);
  };
  result.wall = through(cos_in) * through(cos_out) * cos_in * (1.0 / kPi);
  const double coat_in = in.dot(p.coat_normal), coat_out = out.dot(p.coat_normal);
  if (p.coat.coverage > 0.0 && coat_in > 0.0 && coat_out > 0.0) {
    const Vec3 half = (in + out).normalized();
    // coat_brdf cos_in with the coat's normal as the third axis
    result.coat = p.coat.coverage * ggx_distribution(half.dot(p.coat_normal), p.coat.roughness) *
                  schlick_fresnel(in.dot(half), p.coat.f0) *
                  smith_masking(coat_in, coat_out, p.coat.roughness) / (4.0 * coat_out);
  }
  return result;
}

double scatter_pdf(const ShadedPoint& p, const Vec3& in, const Vec3& out) {
  const double share = coat_share(p, out);
  double pdf = (1.0 - share) * std::max(0.0, in.dot(p.normal)) * (1.0 / kPi);
  if (share > 0.0 && out.dot(p.coat_normal) > 0.0) {
    const Mat3 axes = world_from_local(p.coat_normal);
    const Vec3 half = (in + out).normalized(), h = axes.transpose() * half;
    const double out_half = out.dot(half);
    // dw_in = 4 (out . h) dw_h
    if (out_half > 0.0)
      pdf +=
          share * visible_facet_pdf(p.coat.roughness, axes.transpose() * out, h) / (4.0 * out_half);
  }
  return pdf;
}

ScatterSample sample_scatter(const ShadedPoint& p, const Vec3& out,
                             const std::array<double, 4>& u) {
  Vec3 direction;
  const double share = coat_share(p, out);
  if (u[0] < share) {
    // The wet layer may be turned away where the wall is not; it sends nothing on then.
    if (!(out.dot(p.coat_normal) > 0.0)) return {p.normal, 0.0};
    const Mat3 axes = world_from_local(p.coat_normal);
    const Vec3 half =
        axes * sample_visible_facet(p.coat.roughness, axes.transpose() * out, u[1], u[2]);
    direction = (2.0 * out.dot(half) * half - out).normalized();
  } else {
    const double radius = std::sqrt(u[1]);
    const SineCosine turn = portable_turn(u[2]);
    direction = (world_from_local(p.normal) *
                 Vec3(radius * turn.cosine, radius * turn.sine, std::sqrt(1.0 - u[1])))
                    .normalized();
  }
  if (!(direction.dot(p.normal) > 0.0) || !(direction.dot(p.geometric_normal) > 0.0))
    return {direction, 0.0};
  return {direction, scatter_pdf(p, direction, out)};
}

}  // namespace rugae
