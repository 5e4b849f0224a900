#include "render/bsdf.h"

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

}  // namespace rugae
