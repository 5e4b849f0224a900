#pragma once
// Mucosa: a Lambertian wall under a wet layer.
//
//   f(i, o) = T(i) T(o) albedo / pi  +  coverage D(h) F(i.h) G(i, o) / (4 cos_i cos_o)
//   T(w)    = 1 - coverage F(cos_w)     what the coat lets in and out again
//   D       GGX, G Smith's masking with height correlation, F Schlick's Fresnel
//
// Walter et al., Microfacet models for refraction through rough surfaces, EGSR 2007, eq. 33;
// Heitz, Understanding the masking-shadowing function in microfacet-based BRDFs, JCGT 3(2), 2014,
// eq. 72 and 99; Schlick, An inexpensive BRDF model, 1994, doi:10.1111/1467-8659.1330233.

#include <cmath>

#include "core/float4.h"
#include "core/types.h"
#include "core/units.h"

namespace rugae {

struct Coat {
  double roughness = 0.2;  // GGX alpha
  double coverage = 1.0;   // share of the wall under the wet layer
  double f0 = 0.02;        // Fresnel reflectance at normal incidence
};

/// 1 / sr, over the microfacet normals: integral of D cos over the hemisphere is 1.
double ggx_distribution(double cos_h, double alpha);
/// Smith's G2 with height correlation, for cosines to the mean normal.
double smith_masking(double cos_i, double cos_o, double alpha);
double schlick_fresnel(double cosine, double f0);

/// The wet layer's share of f, 1 / sr; directions are unit, pointing away from the wall, z along
/// the normal; zero below the horizon.
double coat_brdf(const Coat& coat, const Vec3& in, const Vec3& out);
/// The wall's share of f, 1 / sr.
double wall_brdf(const Coat& coat, double albedo, const Vec3& in, const Vec3& out);

/// A facet's normal seen from `out`, drawn with the density that visible_facet_pdf gives; u are
/// uniform in (0, 1). Heitz, Sampling the GGX distribution of visible normals, JCGT 7(4), 2018.
Vec3 sample_visible_facet(double alpha, const Vec3& out, double u1, double u2);
/// 1 / sr over facet normals: G1(out) D(h) (out . h) / cos_out.
double visible_facet_pdf(double alpha, const Vec3& out, const Vec3& half);

/// Light and eye in one place, in = out: what the frames use. Both times cos_i, so that
/// radiance = value * I / d^2. Half vector and direction are the same, so F is F0 and
///   coat cos = coverage D(c) F0 / (4 sqrt(c^2 + alpha^2 (1 - c^2))).
/// For one number or four (float or Float4).
template <typename T>
T coat_retro(T cosine, T alpha, T coverage, T f0) {
  const T a2 = alpha * alpha, c2 = cosine * cosine;
  const T d = c2 * (a2 - 1.0f) + 1.0f;
  const T distribution = a2 / (static_cast<float>(kPi) * d * d);
  return where_positive(cosine,
                        coverage * distribution * f0 / (4.0f * root(c2 + a2 * (1.0f - c2))));
}
/// Times albedo.
template <typename T>
T wall_retro(T cosine, T coverage, T f0) {
  const T m = 1.0f - cosine, m2 = m * m;
  const T through = 1.0f - coverage * (f0 + (1.0f - f0) * m2 * m2 * m);
  return where_positive(cosine, through * through * cosine * static_cast<float>(1.0 / kPi));
}

}  // namespace rugae
