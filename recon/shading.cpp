#include "recon/shading.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "core/check.h"
#include "core/units.h"

namespace rugae {
namespace {

/// At slant 0 dR/dZ vanishes on a flat start and nothing would ever move: a light nearer to the
/// viewing axis than this is taken this far off it, towards the top left, so that bright comes out
/// near (the survey of Zhang et al. 1999, doi:10.1109/34.784284, does the same with 0.01).
constexpr double kMinSlantRad = 0.01;
constexpr double kTopLeftRad = -0.75 * kPi;
/// Steps of the midpoint rule for the moments: error below 1e-5.
constexpr int kMomentSteps = 256;
/// Intensity gradients weaker than this (per px) hold no direction.
constexpr float kMinGradient = 1e-6f;

/// The intensity moments' ratio falls with the slant: solved by bisection to 1e-9 rad.
double slant_from_ratio(double ratio) {
  double low = 0.0, high = kPi / 2;
  const auto ratio_at = [](double slant) {
    const ShadingMoments m = shading_moments(slant);
    return m.mean / m.rms;
  };
  if (ratio >= ratio_at(low)) return low;
  if (ratio <= ratio_at(high)) return high;
  constexpr int kBisections = 30;
  for (int i = 0; i < kBisections; ++i) {
    const double middle = 0.5 * (low + high);
    (ratio_at(middle) > ratio ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

// With normals N = (sin b cos a, sin b sin a, cos b), a uniform, b of density cos b on [0, pi/2],
// and the light in the plane a = 0:
//   I = max(0, cos(s) cos(b) + sin(s) sin(b) cos(a)),
// and over a, with A = cos(s) cos(b), B = sin(s) sin(b), the lit range is |a| < c, where c = pi if
// A >= B and c = acos(-A / B) otherwise:
//   E_a[I]   = (A c + B sin c) / pi
//   E_a[I^2] = (A^2 c + 2 A B sin c + B^2 (c + sin c cos c) / 2) / pi.
ShadingMoments shading_moments(double slant_rad) {
  const double cos_s = std::cos(slant_rad), sin_s = std::sin(slant_rad);
  double mean = 0.0, square = 0.0;
  for (int i = 0; i < kMomentSteps; ++i) {
    const double b = (i + 0.5) * (kPi / 2) / kMomentSteps;
    const double density = std::cos(b) * (kPi / 2) / kMomentSteps;
    const double in = cos_s * std::cos(b), across = sin_s * std::sin(b);
    const double c = in >= across ? kPi : std::acos(-in / across);
    const double sin_c = std::sin(c), cos_c = std::cos(c);
    mean += density * (in * c + across * sin_c) / kPi;
    square += density *
              (in * in * c + 2 * in * across * sin_c + across * across * (c + sin_c * cos_c) / 2) /
              kPi;
  }
  return {mean, std::sqrt(square)};
}

// Tilt: the mean direction of the intensity gradient, tan(tilt) = E[Iy / |grad I|] / E[Ix / |grad
// I|]. Slant: E[I] / sqrt(E[I^2]) = f1 / f2 of the moments above (the paper's f3). Albedo: least
// squares on both moments, (E[I] f1 + sqrt(E[I^2]) f2) / (f1^2 + f2^2).
LightEstimate estimate_light(const cv::Mat& intensity, const cv::Mat& valid) {
  check(intensity.type() == CV_32F && !intensity.empty(), "estimate_light: expected CV_32F pixels");
  check(valid.empty() || (valid.type() == CV_8U && valid.size() == intensity.size()),
        "estimate_light: expected a CV_8U mask of the image's size");
  const auto inside = [&](int y, int x) { return valid.empty() || valid.at<uchar>(y, x) != 0; };
  double mean = 0.0, square = 0.0, direction_x = 0.0, direction_y = 0.0;
  std::size_t count = 0;
  for (int y = 0; y < intensity.rows; ++y)
    for (int x = 0; x < intensity.cols; ++x) {
      if (!inside(y, x)) continue;
      const double value = intensity.at<float>(y, x);
      mean += value;
      square += value * value;
      ++count;
      if (x == 0 || y == 0 || x + 1 == intensity.cols || y + 1 == intensity.rows) continue;
      if (!inside(y, x - 1) || !inside(y, x + 1) || !inside(y - 1, x) || !inside(y + 1, x))
        continue;
      const float gx = 0.5f * (intensity.at<float>(y, x + 1) - intensity.at<float>(y, x - 1));
      const float gy = 0.5f * (intensity.at<float>(y + 1, x) - intensity.at<float>(y - 1, x));
      const float norm = std::hypot(gx, gy);
      if (norm < kMinGradient) continue;
      direction_x += gx / norm;
      direction_y += gy / norm;
    }
  LightEstimate light;
  if (count == 0 || !(mean > 0.0)) return light;
  mean /= count;
  const double rms = std::sqrt(square / count);
  light.tilt_rad =
      direction_x == 0.0 && direction_y == 0.0 ? 0.0 : std::atan2(direction_y, direction_x);
  light.slant_rad = slant_from_ratio(mean / rms);
  const ShadingMoments unit = shading_moments(light.slant_rad);
  light.albedo =
      (mean * unit.mean + rms * unit.rms) / (unit.mean * unit.mean + unit.rms * unit.rms);
  return light;
}

// R = max(0, cos(s) + p cos(t) sin(s) + q sin(t) sin(s)) / n,  n = sqrt(1 + p^2 + q^2).
// p = Z(x,y) - Z(x-1,y) and q = Z(x,y) - Z(x,y-1), so dp/dZ = dq/dZ = 1 and
//   dR/dZ = (cos(t) sin(s) + sin(t) sin(s)) / n - (p + q) R / n^2.
Reflectance reflectance(double p, double q, const Vec3& light) {
  const double n2 = 1.0 + p * p + q * q, n = std::sqrt(n2);
  const double value = std::max(0.0, (light.z() + p * light.x() + q * light.y()) / n);
  return {value, (light.x() + light.y()) / n - (p + q) * value / n2};
}

// f(Z) = E - R,  E = I / albedo,  df/dZ = -dR/dZ.
// The update of Tsai and Shah (equations 10 to 13), Newton's step weighted by a scalar Kalman gain:
//   K = S f' / (W + S f'^2),   Z <- Z - K f,   S <- (1 - K f') S.
// The neighbours' depths are those of the iteration before, so the order of pixels does not matter.
cv::Mat tsai_shah(const cv::Mat& intensity, const cv::Mat& valid, const LightEstimate& light,
                  const ShadingOptions& options) {
  check(intensity.type() == CV_32F && !intensity.empty(), "tsai_shah: expected CV_32F pixels");
  check(valid.empty() || (valid.type() == CV_8U && valid.size() == intensity.size()),
        "tsai_shah: expected a CV_8U mask of the image's size");
  check(light.albedo > 0.0, "tsai_shah: albedo {} is not positive", light.albedo);
  const bool frontal = light.slant_rad < kMinSlantRad;
  const double slant = frontal ? kMinSlantRad : light.slant_rad;
  const double tilt = frontal ? kTopLeftRad : light.tilt_rad;
  const Vec3 to_light(std::cos(tilt) * std::sin(slant), std::sin(tilt) * std::sin(slant),
                      std::cos(slant));

  cv::Mat before = cv::Mat::zeros(intensity.size(), CV_32F), after = before.clone();
  cv::Mat variance(intensity.size(), CV_32F, cv::Scalar(options.s_0));
  cv::Mat everywhere;
  if (valid.empty()) everywhere = cv::Mat(intensity.size(), CV_8U, cv::Scalar(255));
  const cv::Mat& known = valid.empty() ? everywhere : valid;
  for (int iteration = 0; iteration < options.iterations; ++iteration) {
    tbb::parallel_for(0, intensity.rows, [&](int y) {
      const int up = std::max(y - 1, 0);
      const float *row = before.ptr<float>(y), *above = before.ptr<float>(up);
      const uchar *inside = known.ptr<uchar>(y), *inside_above = known.ptr<uchar>(up);
      const float* shown = intensity.ptr<float>(y);
      float* out = after.ptr<float>(y);
      float* s_row = variance.ptr<float>(y);
      for (int x = 0; x < intensity.cols; ++x) {
        if (inside[x] == 0) continue;
        const double z = row[x];
        // No slope across the border of what is known.
        const double p = x > 0 && inside[x - 1] != 0 ? z - row[x - 1] : 0.0;
        const double q = y > 0 && inside_above[x] != 0 ? z - above[x] : 0.0;
        const Reflectance r = reflectance(p, q, to_light);
        const double shade = std::min(shown[x] / light.albedo, 1.0);
        const double f = shade - r.value;
        const double df = -r.by_depth;
        const double gain = s_row[x] * df / (options.w_n + s_row[x] * df * df);
        out[x] = static_cast<float>(z - gain * f);
        s_row[x] = static_cast<float>((1.0 - gain * df) * s_row[x]);
      }
    });
    std::swap(before, after);
  }
  return before;
}

}  // namespace rugae
