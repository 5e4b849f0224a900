#include "recon/refine.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "core/check.h"
#include "core/float8.h"

namespace rugae {
namespace {

// A step below this is the last: each is a fraction of the one before, so that what is left is a
// small part of the tenth of a pixel to which noise lets a place be known.
constexpr double kNegligiblePx = 0.005;
constexpr std::size_t kLanes = 8, kHalf = kLanes / 2;
constexpr double kMinTexture = 1e-9;  // eigenvalue of the Hessian, values in [0, 1]
constexpr std::size_t kLists = 3;     // of a template: values, derivatives by x and by y

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
  pixel_.assign(count_, -1);
  pixel_.resize(whole, 0);
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
  t.eights.resize(kLists * dx_.size());
  const auto entry = [&t](std::size_t pixel, std::size_t list) {
    return &t.eights[pixel / kLanes * kLists * kLanes + list * kLanes + pixel % kLanes];
  };
  const auto pixels_at = [this](std::size_t i) {
    return _mm_castsi128_ps(_mm_loadu_si128(reinterpret_cast<const __m128i*>(&pixel_[i])));
  };
  const Float4 zero = _mm_setzero_ps(), half = splat(0.5F);
  Float4 sum[kLists] = {zero, zero, zero};
  for (std::size_t i = 0; i < dx_.size(); i += kHalf) {
    const auto four = [&](std::ptrdiff_t shift) {
      const float* p = square.data() + shift;
      return _mm_setr_ps(p[at_[i]], p[at_[i + 1]], p[at_[i + 2]], p[at_[i + 3]]);
    };
    const Float4 of_pixels[kLists] = {four(0), half * (four(1) - four(-1)),
                                      half * (four(side) - four(-side))};
    const Float4 pixels = pixels_at(i);
    for (std::size_t list = 0; list < kLists; ++list) {
      const Float4 values = _mm_and_ps(pixels, of_pixels[list]);
      _mm_storeu_ps(entry(i, list), values);
      sum[list] = sum[list] + values;
    }
  }
  Float4 mean[kLists], along[kLists] = {zero, zero, zero};  // values . each list
  for (std::size_t list = 0; list < kLists; ++list)
    mean[list] = splat(static_cast<float>(sum_of(sum[list]) / static_cast<double>(count_)));
  for (std::size_t i = 0; i < dx_.size(); i += kHalf)
    for (std::size_t list = 0; list < kLists; ++list) {
      const Float4 values = _mm_and_ps(pixels_at(i), _mm_loadu_ps(entry(i, list)) - mean[list]);
      _mm_storeu_ps(entry(i, list), values);
      along[list] = along[list] + _mm_loadu_ps(entry(i, 0)) * values;
    }
  const double squares = sum_of(along[0]);
  t.norm = std::sqrt(squares);
  if (!(t.norm > 0.0)) return std::nullopt;
  // A change of gain must not look like motion: the gradient images lose their part along the
  // values.
  const Float4 share_x = splat(static_cast<float>(sum_of(along[1]) / squares)),
               share_y = splat(static_cast<float>(sum_of(along[2]) / squares));
  Float4 xx_sum = zero, xy_sum = zero, yy_sum = zero;
  for (std::size_t i = 0; i < dx_.size(); i += kHalf) {
    const Float4 values = _mm_loadu_ps(entry(i, 0));
    const Float4 gx = _mm_loadu_ps(entry(i, 1)) - share_x * values;
    const Float4 gy = _mm_loadu_ps(entry(i, 2)) - share_y * values;
    _mm_storeu_ps(entry(i, 1), gx);
    _mm_storeu_ps(entry(i, 2), gy);
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
[[gnu::target_clones("avx2", "default")]] std::optional<PointRefiner::Comparison>
PointRefiner::compare(const PointTemplate& sought, const cv::Mat& image, const Vec2& place,
                      const Mat2& linear) const {
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
  // From a pixel at the top left of all of them: places are positive, so that cutting off their
  // fractions is rounding down.
  const double base_x = std::max(0.0, std::floor(u - reach_x)),
               base_y = std::max(0.0, std::floor(v - reach_y));
  const auto u0 = static_cast<float>(u - base_x), v0 = static_cast<float>(v - base_y);
  const auto xx = static_cast<float>(linear(0, 0)), xy = static_cast<float>(linear(0, 1)),
             yx = static_cast<float>(linear(1, 0)), yy = static_cast<float>(linear(1, 1));
  const auto stride = static_cast<int>(image.step1());
  const float* base = image.ptr<float>(static_cast<int>(base_y)) + static_cast<int>(base_x);
  // Near the mean: squares of small numbers keep their digits.
  const float level = image.at<float>(static_cast<int>(v), static_cast<int>(u));
  Float8 sum{}, squares{}, product{}, along_x{}, along_y{};
  const float* lists = sought.eights.data();
  for (std::size_t i = 0; i < dx_.size(); i += kLanes, lists += kLists * kLanes) {
    Float8 dx, dy, of_template, gradient_x, gradient_y;
    Int8 pixel;
    load(&dx_[i], dx);
    load(&dy_[i], dy);
    const Float8 x = u0 + xx * dx + xy * dy, y = v0 + yx * dx + yy * dy;
    const Int8 left_px = __builtin_convertvector(x, Int8),
               top_px = __builtin_convertvector(y, Int8);
    const Int8 offset = top_px * stride + left_px;
    int at[kLanes];
    std::memcpy(at, &offset, sizeof at);
    Float8 top_left, top_right, low_left, low_right;
    neighbours(base, at, top_left, top_right);
    neighbours(base + stride, at, low_left, low_right);
    const Float8 part_x = x - __builtin_convertvector(left_px, Float8),
                 part_y = y - __builtin_convertvector(top_px, Float8);
    const Float8 top = top_left + part_x * (top_right - top_left),
                 low = low_left + part_x * (low_right - low_left);
    load(&pixel_[i], pixel);
    // What fills the lists up is no pixel.
    const Float8 value = reinterpret_cast<Float8>(
        reinterpret_cast<Int8>(top + part_y * (low - top) - level) & pixel);
    load(lists, of_template);
    load(lists + kLanes, gradient_x);
    load(lists + 2 * kLanes, gradient_y);
    sum += value;
    squares += value * value;
    product += value * of_template;
    along_x += value * gradient_x;
    along_y += value * gradient_y;
  }
  // The template's lists have no mean: only the squares hold that of the values.
  const double all = sum_of(sum);
  return Comparison{sum_of(squares) - all * all / static_cast<double>(count_), sum_of(product),
                    sum_of(along_x), sum_of(along_y)};
}

std::optional<Vec2> PointRefiner::operator()(const PointTemplate& sought, const cv::Mat& moving,
                                             const Vec2& start_px, const Mat2& linear) const {
  check(sought.eights.size() == kLists * dx_.size(),
        "point refinement: the template has {} numbers, expected {} of this radius",
        sought.eights.size(), kLists * dx_.size());
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
