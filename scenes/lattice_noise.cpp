#include "scenes/lattice_noise.h"

#include <cmath>

namespace rugae {
namespace {

int wrap(int i, int period) {
  if (period <= 0) return i;
  const int m = i % period;
  return m < 0 ? m + period : m;
}

// The twelve directions to the middles of a cube's edges; four of them twice, as in the paper.
Vec3 lattice_gradient(std::uint32_t hash) {
  static constexpr double kDirections[16][3] = {{1, 1, 0}, {-1, 1, 0}, {1, -1, 0}, {-1, -1, 0},
                                                {1, 0, 1}, {-1, 0, 1}, {1, 0, -1}, {-1, 0, -1},
                                                {0, 1, 1}, {0, -1, 1}, {0, 1, -1}, {0, -1, -1},
                                                {1, 1, 0}, {-1, 1, 0}, {0, -1, 1}, {0, -1, -1}};
  const double* d = kDirections[hash >> 28];
  return {d[0], d[1], d[2]};
}

}  // namespace

NoiseSample gradient_noise(const Vec3& p, std::uint32_t seed, int period) {
  const Vec3 base(std::floor(p.x()), std::floor(p.y()), std::floor(p.z()));
  const Vec3 f = p - base;
  const int i = static_cast<int>(base.x()), j = static_cast<int>(base.y()),
            k = static_cast<int>(base.z());
  // fade(t) = 6 t^5 - 15 t^4 + 10 t^3, with first and second derivative zero at 0 and 1
  double w[3][2], dw[3];
  for (int a = 0; a < 3; ++a) {
    const double t = f[a];
    w[a][1] = t * t * t * (t * (6.0 * t - 15.0) + 10.0);
    w[a][0] = 1.0 - w[a][1];
    dw[a] = 30.0 * t * t * (t * (t - 2.0) + 1.0);
  }
  NoiseSample result;
  for (int c = 0; c < 8; ++c) {
    const int x = c & 1, y = (c >> 1) & 1, z = c >> 2;
    const Vec3 g = lattice_gradient(
        lattice_hash(wrap(i + x, period), wrap(j + y, period), wrap(k + z, period), seed));
    const double dot = g.dot(f - Vec3(x, y, z));
    const double wx = w[0][x], wy = w[1][y], wz = w[2][z];
    result.value += wx * wy * wz * dot;
    result.gradient += wx * wy * wz * g;
    result.gradient += dot * Vec3((x ? dw[0] : -dw[0]) * wy * wz, (y ? dw[1] : -dw[1]) * wx * wz,
                                  (z ? dw[2] : -dw[2]) * wx * wy);
  }
  return result;
}

CellSample cell_noise(const Vec3& p, std::uint32_t seed, int period) {
  const Vec3 base(std::floor(p.x()), std::floor(p.y()), std::floor(p.z()));
  const int i = static_cast<int>(base.x()), j = static_cast<int>(base.y()),
            k = static_cast<int>(base.z());
  double first = 1e30, second = 1e30;
  CellSample result;
  for (int z = -1; z <= 1; ++z)
    for (int y = -1; y <= 1; ++y)
      for (int x = -1; x <= 1; ++x) {
        const std::uint32_t h =
            lattice_hash(wrap(i + x, period), wrap(j + y, period), wrap(k + z, period), seed);
        constexpr double kUnit = 1.0 / 1024.0;  // ten bits a coordinate
        const Vec3 point =
            base + Vec3(x, y, z) + kUnit * Vec3(h & 1023u, (h >> 10) & 1023u, (h >> 20) & 1023u);
        const double d = (p - point).squaredNorm();
        if (d < first) {
          second = first;
          first = d;
          result.id = mix_bits(h);
        } else if (d < second) {
          second = d;
        }
      }
  result.nearest = std::sqrt(first);
  result.second = std::sqrt(second);
  return result;
}

}  // namespace rugae
