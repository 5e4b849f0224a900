#include "render/bsdf.h"

#include <algorithm>

#include "core/portable_math.h"

namespace rugae {

// D(h) = alpha^2 / (pi (cos^2 (alpha^2 - 1) + 1)^2)
double ggx_distribution(double cos_h, double alpha) {
  if (!(cos_h > 0.0)) return 0.0;
  const double a2 = alpha * alpha, d = cos_h * cos_h * (a2 - 1.0) + 1.0;
  return a2 / (kPi * d * d);
}

// G2 = 1 / (1 + Lambda_i + Lambda_o), Lambda = (sqrt(1 + alpha^2 tan^2) - 1) / 2
double smith_masking(double cos_i, double cos_o, double alpha) {
  if (!(cos_i > 0.0) || !(cos_o > 0.0)) return 0.0;
  const auto lambda = [alpha](double cosine) {
    const double tan2 = 1.0 / (cosine * cosine) - 1.0;
    return 0.5 * (std::sqrt(1.0 + alpha * alpha * tan2) - 1.0);
  };
  return 1.0 / (1.0 + lambda(cos_i) + lambda(cos_o));
}

// F = F0 + (1 - F0) (1 - cos)^5
double schlick_fresnel(double cosine, double f0) {
  const double m = 1.0 - cosine;
  return f0 + (1.0 - f0) * m * m * m * m * m;
}

double coat_brdf(const Coat& coat, const Vec3& in, const Vec3& out) {
  if (!(in.z() > 0.0) || !(out.z() > 0.0)) return 0.0;
  const Vec3 half = (in + out).normalized();
  return coat.coverage * ggx_distribution(half.z(), coat.roughness) *
         schlick_fresnel(in.dot(half), coat.f0) * smith_masking(in.z(), out.z(), coat.roughness) /
         (4.0 * in.z() * out.z());
}

double wall_brdf(const Coat& coat, double albedo, const Vec3& in, const Vec3& out) {
  if (!(in.z() > 0.0) || !(out.z() > 0.0)) return 0.0;
  const auto through = [&coat](double cosine) {
    return 1.0 - coat.coverage * schlick_fresnel(cosine, coat.f0);
  };
  return through(in.z()) * through(out.z()) * albedo / kPi;
}

// The ellipsoid of facets is stretched to a hemisphere, whose visible part projects to a disk cut
// short on one side; a point of it is drawn and taken back.
Vec3 sample_visible_facet(double alpha, const Vec3& out, double u1, double u2) {
  const Vec3 view = Vec3(alpha * out.x(), alpha * out.y(), out.z()).normalized();
  const double across2 = view.x() * view.x() + view.y() * view.y();
  const Vec3 e1 = across2 > 0.0 ? Vec3(Vec3(-view.y(), view.x(), 0.0) / std::sqrt(across2))
                                : Vec3(Vec3::UnitX());
  const Vec3 e2 = view.cross(e1);
  const double radius = std::sqrt(u1);
  const SineCosine turn = portable_turn(u2);
  const double a = radius * turn.cosine, share = 0.5 * (1.0 + view.z());
  const double rest = std::sqrt(std::max(0.0, 1.0 - a * a));
  const double b = (1.0 - share) * rest + share * radius * turn.sine;
  const Vec3 n = a * e1 + b * e2 + std::sqrt(std::max(0.0, 1.0 - a * a - b * b)) * view;
  return Vec3(alpha * n.x(), alpha * n.y(), std::max(1e-9, n.z())).normalized();
}

double visible_facet_pdf(double alpha, const Vec3& out, const Vec3& half) {
  if (!(out.z() > 0.0)) return 0.0;
  // G1 is G2 with the other side unmasked.
  return smith_masking(out.z(), 1.0, alpha) * ggx_distribution(half.z(), alpha) *
         std::max(0.0, out.dot(half)) / out.z();
}

}  // namespace rugae
