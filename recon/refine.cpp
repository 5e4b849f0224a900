#include "recon/refine.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <opencv2/core.hpp>
#include <vector>

namespace rugae {
namespace {

constexpr double kNegligiblePx = 0.005;

// Bilinear; empty outside.
bool sample(const cv::Mat& image, double x, double y, float& value) {
  const double u = x - 0.5, v = y - 0.5;
  if (!(u >= 0.0 && v >= 0.0 && u < image.cols - 1 && v < image.rows - 1)) return false;
  const int ix = static_cast<int>(u), iy = static_cast<int>(v);
  const float fx = static_cast<float>(u - ix), fy = static_cast<float>(v - iy);
  const float* p0 = image.ptr<float>(iy) + ix;
  const float* p1 = image.ptr<float>(iy + 1) + ix;
  value = (1 - fy) * ((1 - fx) * p0[0] + fx * p0[1]) + fy * ((1 - fx) * p1[0] + fx * p1[1]);
  return true;
}

struct Template {
  std::vector<Vec2f> offsets;   // from the centre, reference px
  std::vector<float> value;     // mean removed
  std::vector<Vec2f> gradient;  // d value / d place in the reference, mean removed
  double norm = 0.0;
  Mat2 hessian = Mat2::Zero();
};

bool make_template(const cv::Mat& reference, const Vec2& center, double radius, Template& t) {
  const int r = static_cast<int>(radius);
  double mean = 0.0;
  Vec2 mean_gradient = Vec2::Zero();
  for (int dy = -r; dy <= r; ++dy) {
    for (int dx = -r; dx <= r; ++dx) {
      if (dx * dx + dy * dy >= radius * radius) continue;
      const double x = center.x() + dx, y = center.y() + dy;
      float v = 0, left = 0, right = 0, up = 0, down = 0;
      if (!(sample(reference, x, y, v) && sample(reference, x - 1, y, left) &&
            sample(reference, x + 1, y, right) && sample(reference, x, y - 1, up) &&
            sample(reference, x, y + 1, down)))
        return false;
      t.offsets.emplace_back(static_cast<float>(dx), static_cast<float>(dy));
      t.value.push_back(v);
      t.gradient.emplace_back(0.5F * (right - left), 0.5F * (down - up));
      mean += v;
      mean_gradient += t.gradient.back().cast<double>();
    }
  }
  const double n = static_cast<double>(t.value.size());
  mean /= n;
  mean_gradient /= n;
  double squares = 0.0;
  Vec2 along = Vec2::Zero();  // gradient . template
  for (std::size_t i = 0; i < t.value.size(); ++i) {
    t.value[i] -= static_cast<float>(mean);
    t.gradient[i] -= mean_gradient.cast<float>();
    squares += static_cast<double>(t.value[i]) * t.value[i];
    along += t.value[i] * t.gradient[i].cast<double>();
  }
  t.norm = std::sqrt(squares);
  if (!(t.norm > 0.0)) return false;
  // A change of gain must not look like motion: the gradient images lose their part along the
  // template.
  for (std::size_t i = 0; i < t.value.size(); ++i) {
    t.gradient[i] -= (along / squares).cast<float>() * t.value[i];
    const Vec2 g = t.gradient[i].cast<double>();
    t.hessian += g * g.transpose();
  }
  return true;
}

}  // namespace

std::optional<Vec2> refine_point(const cv::Mat& reference, const cv::Mat& moving,
                                 const Vec2& reference_px, const Vec2& moving_px,
                                 const Mat2& linear, const PointRefinementOptions& options) {
  Template t;
  if (!make_template(reference, reference_px, options.radius_px, t)) return std::nullopt;
  const Eigen::SelfAdjointEigenSolver<Mat2> eigen(t.hessian);
  const double weakest = eigen.eigenvalues()[0];
  if (!(weakest > 1e-9)) return std::nullopt;
  const Mat2 inverse_hessian = t.hessian.inverse();
  const std::size_t n = t.value.size();
  std::vector<float> seen(n);
  Vec2 place = moving_px;
  for (int iteration = 0; iteration < options.max_iterations; ++iteration) {
    double mean = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      const Vec2 at = place + linear * t.offsets[i].cast<double>();
      if (!sample(moving, at.x(), at.y(), seen[i])) return std::nullopt;
      mean += seen[i];
    }
    mean /= static_cast<double>(n);
    double squares = 0.0, product = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      seen[i] -= static_cast<float>(mean);
      squares += static_cast<double>(seen[i]) * seen[i];
      product += static_cast<double>(seen[i]) * t.value[i];
    }
    if (!(product > 0.0)) return std::nullopt;
    // seen ~ gain (template - gradient . d): the gain by projection, then d by least squares.
    const double gain = product / (t.norm * t.norm);
    Vec2 b = Vec2::Zero();
    double residual = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      const double r = seen[i] / gain - t.value[i];
      b += r * t.gradient[i].cast<double>();
      residual += r * r;
    }
    const Vec2 step = -(linear * (inverse_hessian * b));
    if (step.norm() >= kNegligiblePx) {
      place += step;
      if (!((place - moving_px).norm() <= options.max_motion_px)) return std::nullopt;
      continue;
    }
    const double correlation = product / (t.norm * std::sqrt(squares));
    const double deviation_px = std::sqrt(residual / static_cast<double>(n - 4) / weakest);
    const bool good =
        correlation >= options.min_correlation && deviation_px <= options.max_deviation_px;
    return good ? std::optional<Vec2>(place) : std::nullopt;
  }
  return std::nullopt;
}

}  // namespace rugae
