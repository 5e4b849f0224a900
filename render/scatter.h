#pragma once
// How a point of the wall, with a normal of its own for the wet layer, sends light on: what it
// gives, and where paths go on from it.

#include <array>

#include "render/bsdf.h"
#include "render/surface.h"

namespace rugae {

/// A point of the wall seen from one side; normals are unit vectors of that side, world axes.
struct ShadedPoint {
  Vec3 geometric_normal, normal, coat_normal;
  Coat coat;
  Vec3 albedo;  // linear RGB

  ShadedPoint() = default;
  /// Seen along `direction_world` (unit, towards the wall).
  ShadedPoint(const Vec3& geometric_normal, const Vec3f& shading_normal,
              const MucosaSample& material, const Vec3& direction_world);
};

/// f cos_in of both layers, 1 / sr.
struct Scattered {
  double wall = 0.0;  // for an albedo of 1
  double coat = 0.0;
};

/// Directions are unit, away from the wall; light that comes from behind the triangle or the
/// shading normal gives nothing. The cosine of the wet layer's share is to its own normal.
Scattered scatter(const ShadedPoint& point, const Vec3& in, const Vec3& out);

/// A way on for a path, drawn in proportion to about what it will carry.
struct ScatterSample {
  Vec3 direction;  // away from the wall
  double pdf;      // 1 / sr; 0: the direction leads into the wall
};
/// Cosine and visible facets in a mixture; u are uniform in (0, 1).
ScatterSample sample_scatter(const ShadedPoint& point, const Vec3& out,
                             const std::array<double, 4>& u);
/// The density of sample_scatter, 1 / sr, of a direction before it is known whether it leads into
/// the wall: it integrates to one over the sphere but for facets that mirror to below.
double scatter_pdf(const ShadedPoint& point, const Vec3& in, const Vec3& out);

}  // namespace rugae
