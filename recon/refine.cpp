#include "recon/refine.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "core/check.h"
#include "core/float4.h"

namespace rugae {
namespace {

// A step below this is the last: each is a fraction of the one before, so that what is left is a
// small part of the tenth of a pixel to which noise lets a place be known.
constexpr double kNegligiblePx = 0.005;
constexpr std::size_t kLanes = 4;
constexpr double kMinTexture = 1e-9;  // eigenvalue of the Hessian, values in [0, 1]
constexpr std::size_t kLists = 3;     // of a template: values, derivatives by x and by y

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

// Sums over the disc, of a picture's values less their mean.
struct PointRefiner::Comparison {
  double squares, with_template, with_gradient_x, with_gradient_y;
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
  at_.resize(whole, at_.front());
  const Float4 lane = _mm_setr_ps(0.0F, 1.0F, 2.0F, 3.0F);
  last_ = _mm_cmplt_ps(lane, splat(static_cast<float>(count_ - (whole - kLanes))));
}

std::optional<PointTemplate> PointRefiner::make_template(const cv::Mat& reference,
                                                         const Vec2& center) const {
  // All pixels of the patch have one fraction, so the square around it is interpolated once and the
  // gradients are differences in it.
  const int side = 2 * radius_ + 3;
  const double left = center.x() - 0.5 - (radius_ + 1), top = center.y() - 0.5 - (radius_ + 1);
  if (!(left >= 0.0 && top >= 0.0 && left + side - 1 < reference.cols - 1 &&
        top + side - 1 < reference.rows - 1))
    return std::nullopt;
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
  PointTemplate t;
  t.fours.resize(kLists * dx_.size());
  const auto groups = static_cast<std::ptrdiff_t>(dx_.size() / kLanes);
  const auto list = [&t](std::ptrdiff_t group, std::size_t of) {
    return t.fours.data() + (group * static_cast<std::ptrdiff_t>(kLists) + of) * kLanes;
  };
  const Float4 zero = _mm_setzero_ps(), half = splat(0.5F);
  Float4 sum[kLists] = {zero, zero, zero};
  for (std::ptrdiff_t group = 0; group < groups; ++group) {
    const int* at = &at_[group * kLanes];
    const auto four = [&](std::ptrdiff_t shift) {
      const float* p = square.data() + shift;
      return _mm_setr_ps(p[at[0]], p[at[1]], p[at[2]], p[at[3]]);
    };
    const Float4 of_pixels[kLists] = {four(0), half * (four(1) - four(-1)),
                                      half * (four(side) - four(-side))};
    for (std::size_t l = 0; l < kLists; ++l) {
      const Float4 values = group + 1 < groups ? of_pixels[l] : _mm_and_ps(last_, of_pixels[l]);
      _mm_storeu_ps(list(group, l), values);
      sum[l] = sum[l] + values;
    }
  }
  Float4 mean[kLists], along[kLists] = {zero, zero, zero};  // values . each list
  for (std::size_t l = 0; l < kLists; ++l)
    mean[l] = splat(static_cast<float>(sum_of(sum[l]) / static_cast<double>(count_)));
  for (std::ptrdiff_t group = 0; group < groups; ++group)
    for (std::size_t l = 0; l < kLists; ++l) {
      Float4 values = _mm_loadu_ps(list(group, l)) - mean[l];
      if (group + 1 == groups) values = _mm_and_ps(last_, values);
      _mm_storeu_ps(list(group, l), values);
      along[l] = along[l] + _mm_loadu_ps(list(group, 0)) * values;
    }
  const double squares = sum_of(along[0]);
  t.norm = std::sqrt(squares);
  if (!(t.norm > 0.0)) return std::nullopt;
  // A change of gain must not look like motion: the gradient images lose their part along the
  // values.
  const Float4 share_x = splat(static_cast<float>(sum_of(along[1]) / squares)),
               share_y = splat(static_cast<float>(sum_of(along[2]) / squares));
  Float4 xx_sum = zero, xy_sum = zero, yy_sum = zero;
  for (std::ptrdiff_t group = 0; group < groups; ++group) {
    const Float4 values = _mm_loadu_ps(list(group, 0));
    const Float4 gx = _mm_loadu_ps(list(group, 1)) - share_x * values;
    const Float4 gy = _mm_loadu_ps(list(group, 2)) - share_y * values;
    _mm_storeu_ps(list(group, 1), gx);
    _mm_storeu_ps(list(group, 2), gy);
    xx_sum = xx_sum + gx * gx;
    xy_sum = xy_sum + gx * gy;
    yy_sum = yy_sum + gy * gy;
  }
  const double xx = sum_of(xx_sum), xy = sum_of(xy_sum), yy = sum_of(yy_sum);
  Mat2 hessian;
  hessian << xx, xy, xy, yy;
  t.weakest = Eigen::SelfAdjointEigenSolver<Mat2>(hessian, Eigen::EigenvaluesOnly).eigenvalues()[0];
  if (!(t.weakest > kMinTexture)) return std::nullopt;
  t.inverse_hessian = hessian.inverse();
  return t;
}

// With the image at place + linear * (dx, dy), bilinear; empty when a pixel is outside.
std::optional<PointRefiner::Comparison> PointRefiner::compare(const PointTemplate& sought,
                                                              const cv::Mat& image,
                                                              const Vec2& place,
                                                              const Mat2& linear) const {
  // Whole and small numbers apart: a float holds the fraction of a place near zero alone.
  const double u = place.x() - 0.5, v = place.y() - 0.5;
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
        return std::nullopt;
    }
  }
  const int base_x = static_cast<int>(std::floor(u)), base_y = static_cast<int>(std::floor(v));
  const Float4 u0 = splat(static_cast<float>(u - base_x)),
               v0 = splat(static_cast<float>(v - base_y));
  const Float4 xx = splat(static_cast<float>(linear(0, 0))),
               xy = splat(static_cast<float>(linear(0, 1))),
               yx = splat(static_cast<float>(linear(1, 0))),
               yy = splat(static_cast<float>(linear(1, 1)));
  const int stride = static_cast<int>(image.step1());
  const float* base = image.ptr<float>(0) + static_cast<std::ptrdiff_t>(base_y) * stride + base_x;
  const Float4 row = splat(static_cast<float>(stride)), one = splat(1.0F);
  const Float4 level = splat(*base);  // near the mean: squares of small numbers keep their digits
  const auto values_of = [&](std::size_t i) {
    const Float4 dx = _mm_loadu_ps(&dx_[i]), dy = _mm_loadu_ps(&dy_[i]);
    const Floor x = floor_of(u0 + xx * dx + xy * dy), y = floor_of(v0 + yx * dx + yy * dy);
    // Exact: whole numbers below 2^24.
    int at[kLanes];
    _mm_storeu_si128(reinterpret_cast<__m128i*>(at),
                     _mm_cvttps_epi32(row * _mm_cvtepi32_ps(y.whole) + _mm_cvtepi32_ps(x.whole)));
    const Neighbours above = neighbours(base, at), below = neighbours(base + stride, at);
    return (one - y.part) * ((one - x.part) * above.left + x.part * above.right) +
           y.part * ((one - x.part) * below.left + x.part * below.right) - level;
  };
  Float4 sum = _mm_setzero_ps(), squares = sum, product = sum, along_x = sum, along_y = sum;
  const auto add = [&](Float4 value, const float* t) {
    sum = sum + value;
    squares = squares + value * value;
    product = product + value * _mm_loadu_ps(t);
    along_x = along_x + value * _mm_loadu_ps(t + kLanes);
    along_y = along_y + value * _mm_loadu_ps(t + 2 * kLanes);
  };
  const std::size_t last = dx_.size() - kLanes;
  for (std::size_t i = 0; i < last; i += kLanes) add(values_of(i), &sought.fours[kLists * i]);
  add(_mm_and_ps(last_, values_of(last)), &sought.fours[kLists * last]);
  // The template's lists have no mean: only the squares hold that of the values.
  const double all = sum_of(sum);
  return Comparison{sum_of(squares) - all * all / static_cast<double>(count_), sum_of(product),
                    sum_of(along_x), sum_of(along_y)};
}

std::optional<Vec2> PointRefiner::operator()(const PointTemplate& sought, const cv::Mat& moving,
                                             const Vec2& start_px, const Mat2& linear) const {
  check(sought.fours.size() == kLists * dx_.size(),
        "point refinement: the template has {} numbers, expected {} of this radius",
        sought.fours.size(), kLists * dx_.size());
  Vec2 place = start_px;
  for (int iteration = 0; iteration < options_.max_iterations; ++iteration) {
    if (!place.allFinite()) return std::nullopt;
    const auto seen = compare(sought, moving, place, linear);
    if (!seen || !(seen->with_template > 0.0)) return std::nullopt;
    // seen ~ gain (template - gradient . d): the gain by projection, then d by least squares; the
    // gradients have nothing along the template.
    const double inverse_gain = sought.norm * sought.norm / seen->with_template;
    const Vec2 step =
        -inverse_gain *
        (linear * (sought.inverse_hessian * Vec2(seen->with_gradient_x, seen->with_gradient_y)));
    place += step;
    if (!((place - start_px).norm() <= options_.max_motion_px)) return std::nullopt;
    if (step.norm() >= kNegligiblePx) continue;
    const double correlation = seen->with_template / (sought.norm * std::sqrt(seen->squares));
    const double residual =
        std::max(0.0, inverse_gain * inverse_gain * seen->squares - sought.norm * sought.norm);
    const double deviation_px =
        std::sqrt(residual / (static_cast<double>(count_) - 4.0) / sought.weakest);
    const bool good =
        correlation >= options_.min_correlation && deviation_px <= options_.max_deviation_px;
    return good ? std::optional<Vec2>(place) : std::nullopt;
  }
  return std::nullopt;
}

std::optional<Vec2> refine_point(const cv::Mat& reference, const cv::Mat& moving,
                                 const Vec2& reference_px, const Vec2& moving_px,
                                 const Mat2& linear, const PointRefinementOptions& options) {
  const PointRefiner refiner(options);
  const auto sought = refiner.make_template(reference, reference_px);
  return sought ? refiner(*sought, moving, moving_px, linear) : std::nullopt;
}

}  // namespace rugae
