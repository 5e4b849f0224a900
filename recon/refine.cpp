#include "recon/refine.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "core/float4.h"

namespace rugae {
namespace {

constexpr double kNegligiblePx = 0.005;
constexpr std::size_t kLanes = 4;

double sum_of(Float4 v) {
  float lane[kLanes];
  _mm_storeu_ps(lane, v);
  return (static_cast<double>(lane[0]) + lane[1]) + (static_cast<double>(lane[2]) + lane[3]);
}

// Two neighbours a place, at four places: the left ones and the right ones.
struct Neighbours {
  Float4 left, right;
};
Neighbours neighbours(const float* base, const int (&at)[kLanes]) {
  const Float4 first = two_and_two(base + at[0], base + at[1]);
  const Float4 last = two_and_two(base + at[2], base + at[3]);
  return {_mm_shuffle_ps(first, last, _MM_SHUFFLE(2, 0, 2, 0)),
          _mm_shuffle_ps(first, last, _MM_SHUFFLE(3, 1, 3, 1))};
}

}  // namespace

// All lists are as long as the disc's, filled up with zeros.
struct PointRefiner::Template {
  std::vector<float> value;                   // mean removed
  std::vector<float> gradient_x, gradient_y;  // d value / d place in the reference, mean removed
  double norm = 0.0;
  Mat2 hessian = Mat2::Zero();
};

PointRefiner::PointRefiner(const PointRefinementOptions& options)
    : options_(options), radius_(static_cast<int>(options.radius_px)) {
  const int side = 2 * radius_ + 3;
  for (int y = -radius_; y <= radius_; ++y) {
    for (int x = -radius_; x <= radius_; ++x) {
      if (x * x + y * y >= options.radius_px * options.radius_px) continue;
      dx_.push_back(static_cast<float>(x));
      dy_.push_back(static_cast<float>(y));
      at_.push_back((y + radius_ + 1) * side + x + radius_ + 1);
    }
  }
  count_ = dx_.size();
  const std::size_t whole = (count_ + kLanes - 1) / kLanes * kLanes;
  dx_.resize(whole, 0.0F);
  dy_.resize(whole, 0.0F);
}

bool PointRefiner::make_template(const cv::Mat& reference, const Vec2& center, Template& t) const {
  // All pixels of the patch have one fraction, so the square around it is interpolated once and the
  // gradients are differences in it.
  const int side = 2 * radius_ + 3;
  const double left = center.x() - 0.5 - (radius_ + 1), top = center.y() - 0.5 - (radius_ + 1);
  if (!(left >= 0.0 && top >= 0.0 && left + side - 1 < reference.cols - 1 &&
        top + side - 1 < reference.rows - 1))
    return false;
  const int ix = static_cast<int>(left), iy = static_cast<int>(top);
  const float fx = static_cast<float>(left - ix), fy = static_cast<float>(top - iy);
  std::vector<float> square(static_cast<std::size_t>(side) * side);
  for (int y = 0; y < side; ++y) {
    const float* p0 = reference.ptr<float>(iy + y) + ix;
    const float* p1 = reference.ptr<float>(iy + y + 1) + ix;
    float* row = square.data() + static_cast<std::ptrdiff_t>(y) * side;
    for (int x = 0; x < side; ++x)
      row[x] =
          (1 - fy) * ((1 - fx) * p0[x] + fx * p0[x + 1]) + fy * ((1 - fx) * p1[x] + fx * p1[x + 1]);
  }
  const std::size_t whole = dx_.size();
  t.value.assign(whole, 0.0F);
  t.gradient_x.assign(whole, 0.0F);
  t.gradient_y.assign(whole, 0.0F);
  double mean = 0.0, mean_x = 0.0, mean_y = 0.0;
  for (std::size_t i = 0; i < count_; ++i) {
    const float* p = square.data() + at_[i];
    t.value[i] = p[0];
    t.gradient_x[i] = 0.5F * (p[1] - p[-1]);
    t.gradient_y[i] = 0.5F * (p[side] - p[-side]);
    mean += t.value[i];
    mean_x += t.gradient_x[i];
    mean_y += t.gradient_y[i];
  }
  const double n = static_cast<double>(count_);
  const float m = static_cast<float>(mean / n), mx = static_cast<float>(mean_x / n),
              my = static_cast<float>(mean_y / n);
  double squares = 0.0, along_x = 0.0, along_y = 0.0;  // gradient . template
  for (std::size_t i = 0; i < count_; ++i) {
    t.value[i] -= m;
    t.gradient_x[i] -= mx;
    t.gradient_y[i] -= my;
    squares += static_cast<double>(t.value[i]) * t.value[i];
    along_x += static_cast<double>(t.value[i]) * t.gradient_x[i];
    along_y += static_cast<double>(t.value[i]) * t.gradient_y[i];
  }
  t.norm = std::sqrt(squares);
  if (!(t.norm > 0.0)) return false;
  // A change of gain must not look like motion: the gradient images lose their part along the
  // template.
  const float gx = static_cast<float>(along_x / squares),
              gy = static_cast<float>(along_y / squares);
  double xx = 0.0, xy = 0.0, yy = 0.0;
  for (std::size_t i = 0; i < count_; ++i) {
    t.gradient_x[i] -= gx * t.value[i];
    t.gradient_y[i] -= gy * t.value[i];
    xx += static_cast<double>(t.gradient_x[i]) * t.gradient_x[i];
    xy += static_cast<double>(t.gradient_x[i]) * t.gradient_y[i];
    yy += static_cast<double>(t.gradient_y[i]) * t.gradient_y[i];
  }
  t.hessian << xx, xy, xy, yy;
  return true;
}

// The image at place + linear * (dx, dy), bilinear; false when a pixel is outside.
bool PointRefiner::sample(const cv::Mat& image, const Vec2& place, const Mat2& linear,
                          std::vector<float>& values) const {
  // Whole and small numbers apart: a float holds the fraction of a place near zero alone.
  const double u = place.x() - 0.5, v = place.y() - 0.5;
  const int base_x = static_cast<int>(std::floor(u)), base_y = static_cast<int>(std::floor(v));
  const Float4 u0 = splat(static_cast<float>(u - base_x)),
               v0 = splat(static_cast<float>(v - base_y));
  const Float4 xx = splat(static_cast<float>(linear(0, 0))),
               xy = splat(static_cast<float>(linear(0, 1))),
               yx = splat(static_cast<float>(linear(1, 0))),
               yy = splat(static_cast<float>(linear(1, 1)));
  // No pixel is further off than the radius: |linear d| <= radius |row of linear|.
  const double reach_x = options_.radius_px * linear.row(0).norm() + 1.0;
  const double reach_y = options_.radius_px * linear.row(1).norm() + 1.0;
  const bool surely_inside = u - reach_x >= 0.0 && v - reach_y >= 0.0 &&
                             u + reach_x < image.cols - 1 && v + reach_y < image.rows - 1;
  if (!surely_inside) {
    for (std::size_t i = 0; i < count_; ++i) {
      const double x = u + linear(0, 0) * dx_[i] + linear(0, 1) * dy_[i];
      const double y = v + linear(1, 0) * dx_[i] + linear(1, 1) * dy_[i];
      // A rounding error of the floats below must not leave the image either.
      constexpr double kRounding = 1e-4;
      if (!(x >= kRounding && y >= kRounding && x < image.cols - 1 - kRounding &&
            y < image.rows - 1 - kRounding))
        return false;
    }
  }
  const int stride = static_cast<int>(image.step1());
  const float* base = image.ptr<float>(0) + static_cast<std::ptrdiff_t>(base_y) * stride + base_x;
  const Float4 row = splat(static_cast<float>(stride)), one = splat(1.0F);
  for (std::size_t i = 0; i < dx_.size(); i += kLanes) {
    const Float4 dx = _mm_loadu_ps(&dx_[i]), dy = _mm_loadu_ps(&dy_[i]);
    const Floor x = floor_of(u0 + xx * dx + xy * dy), y = floor_of(v0 + yx * dx + yy * dy);
    // Exact: whole numbers below 2^24.
    int at[kLanes];
    _mm_storeu_si128(reinterpret_cast<__m128i*>(at),
                     _mm_cvttps_epi32(row * _mm_cvtepi32_ps(y.whole) + _mm_cvtepi32_ps(x.whole)));
    const Neighbours above = neighbours(base, at), below = neighbours(base + stride, at);
    _mm_storeu_ps(&values[i],
                  (one - y.part) * ((one - x.part) * above.left + x.part * above.right) +
                      y.part * ((one - x.part) * below.left + x.part * below.right));
  }
  return true;
}

std::optional<Vec2> PointRefiner::operator()(const cv::Mat& reference, const cv::Mat& moving,
                                             const Vec2& reference_px, const Vec2& moving_px,
                                             const Mat2& linear) const {
  Template t;
  if (!make_template(reference, reference_px, t)) return std::nullopt;
  const Eigen::SelfAdjointEigenSolver<Mat2> eigen(t.hessian);
  const double weakest = eigen.eigenvalues()[0];
  if (!(weakest > 1e-9)) return std::nullopt;
  const Mat2 inverse_hessian = t.hessian.inverse();
  const std::size_t whole = dx_.size();
  const double n = static_cast<double>(count_);
  std::vector<float> seen(whole);
  Vec2 place = moving_px;
  for (int iteration = 0; iteration < options_.max_iterations; ++iteration) {
    if (!place.allFinite() || !sample(moving, place, linear, seen)) return std::nullopt;
    std::fill(seen.begin() + static_cast<std::ptrdiff_t>(count_), seen.end(), 0.0F);
    Float4 sum = _mm_setzero_ps();
    for (std::size_t i = 0; i < whole; i += kLanes) sum = sum + _mm_loadu_ps(&seen[i]);
    const Float4 mean = splat(static_cast<float>(sum_of(sum) / n));
    Float4 square_sum = _mm_setzero_ps(), product_sum = square_sum;
    for (std::size_t i = 0; i < whole; i += kLanes) {
      const Float4 s = _mm_loadu_ps(&seen[i]) - mean;
      _mm_storeu_ps(&seen[i], s);
      square_sum = square_sum + s * s;
      product_sum = product_sum + s * _mm_loadu_ps(&t.value[i]);
    }
    // What fills the list up is no pixel.
    std::fill(seen.begin() + static_cast<std::ptrdiff_t>(count_), seen.end(), 0.0F);
    const double filled = static_cast<double>(whole - count_);
    const double mean_value = static_cast<double>(_mm_cvtss_f32(mean));
    const double squares = sum_of(square_sum) - filled * mean_value * mean_value;
    const double product = sum_of(product_sum);
    if (!(product > 0.0)) return std::nullopt;
    // seen ~ gain (template - gradient . d): the gain by projection, then d by least squares.
    const Float4 inverse_gain = splat(static_cast<float>(t.norm * t.norm / product));
    Float4 b_x = _mm_setzero_ps(), b_y = b_x, residual_sum = b_x;
    for (std::size_t i = 0; i < whole; i += kLanes) {
      const Float4 r = _mm_loadu_ps(&seen[i]) * inverse_gain - _mm_loadu_ps(&t.value[i]);
      b_x = b_x + r * _mm_loadu_ps(&t.gradient_x[i]);
      b_y = b_y + r * _mm_loadu_ps(&t.gradient_y[i]);
      residual_sum = residual_sum + r * r;
    }
    const Vec2 step = -(linear * (inverse_hessian * Vec2(sum_of(b_x), sum_of(b_y))));
    if (step.norm() >= kNegligiblePx) {
      place += step;
      if (!((place - moving_px).norm() <= options_.max_motion_px)) return std::nullopt;
      continue;
    }
    const double correlation = product / (t.norm * std::sqrt(squares));
    const double deviation_px = std::sqrt(sum_of(residual_sum) / (n - 4.0) / weakest);
    const bool good =
        correlation >= options_.min_correlation && deviation_px <= options_.max_deviation_px;
    return good ? std::optional<Vec2>(place) : std::nullopt;
  }
  return std::nullopt;
}

std::optional<Vec2> refine_point(const cv::Mat& reference, const cv::Mat& moving,
                                 const Vec2& reference_px, const Vec2& moving_px,
                                 const Mat2& linear, const PointRefinementOptions& options) {
  return PointRefiner(options)(reference, moving, reference_px, moving_px, linear);
}

}  // namespace rugae
