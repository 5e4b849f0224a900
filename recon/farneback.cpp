#include "recon/farneback.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/check.h"
#include "core/float4.h"

namespace rugae {
namespace {

constexpr int kHalvings = 2;  // the start is within a few pixels: a taller pyramid adds nothing
constexpr int kSmallestPx = 32;
constexpr int kIterations = 3;
constexpr int kReachPx = 7;  // of the polynomial's neighbourhood
constexpr double kSigmaPx = 1.5;
constexpr int kWindowPx = 21, kHalfWindowPx = kWindowPx / 2;
constexpr float kRegular = 1e-3F;  // added to the determinant: no texture, no motion
constexpr int kLanes = 4;
constexpr int kMoments = 5;  // of a pixel's equations

// Certainty of the polynomials near the border, whose neighbourhood is cut off.
constexpr int kBorderPx = 5;
constexpr std::array<float, kBorderPx> kBorderCertainty = {0.14F, 0.14F, 0.4472F, 0.4472F, 0.4472F};

// Weighted least squares of the basis 1, x, y, x^2, y^2, xy under a Gaussian applicability. By
// symmetry the inverse of its Gram matrix has four different entries that count.
struct Basis {
  std::array<float, kReachPx + 1> g, xg, xxg;  // applicability times 1, x, x^2
  float linear, constant_to_square, square, mixed;

  Basis() {
    std::array<double, 2 * kReachPx + 1> weight{};
    double sum = 0.0;
    for (int x = -kReachPx; x <= kReachPx; ++x)
      sum += weight[x + kReachPx] = std::exp(-x * x / (2.0 * kSigmaPx * kSigmaPx));
    Eigen::Matrix<double, 6, 6> gram = Eigen::Matrix<double, 6, 6>::Zero();
    for (double& w : weight) w /= sum;
    for (int y = -kReachPx; y <= kReachPx; ++y)
      for (int x = -kReachPx; x <= kReachPx; ++x) {
        Eigen::Matrix<double, 6, 1> b;
        b << 1.0, x, y, x * x, y * y, x * y;
        gram += weight[x + kReachPx] * weight[y + kReachPx] * b * b.transpose();
      }
    const Eigen::Matrix<double, 6, 6> inverse = gram.inverse();
    linear = static_cast<float>(inverse(1, 1));
    constant_to_square = static_cast<float>(inverse(0, 3));
    square = static_cast<float>(inverse(3, 3));
    mixed = static_cast<float>(inverse(5, 5));
    for (int x = 0; x <= kReachPx; ++x) {
      g[x] = static_cast<float>(weight[x + kReachPx]);
      xg[x] = static_cast<float>(x * weight[x + kReachPx]);
      xxg[x] = static_cast<float>(x * x * weight[x + kReachPx]);
    }
  }
};

// A row with its ends repeated, so that the taps left and right of it exist.
class PaddedRow {
 public:
  PaddedRow(int width, int margin)
      : width_(width), margin_(margin), values_(width + 2 * static_cast<std::size_t>(margin)) {}
  float* begin() { return values_.data() + margin_; }
  void repeat_ends() {
    std::fill(values_.begin(), values_.begin() + margin_, values_[margin_]);
    std::fill(values_.end() - margin_, values_.end(), values_[margin_ + width_ - 1]);
  }

 private:
  int width_, margin_;
  std::vector<float> values_;
};

// The correlations of the image with the basis, first down the columns, then along the rows.
PolynomialLevel expanded(const cv::Mat& image, const Basis& basis) {
  const int width = image.cols;
  PolynomialLevel level{cv::Mat(image.size(), CV_32FC4), cv::Mat(image.size(), CV_32F)};
  PaddedRow by_1(width, kReachPx), by_y(width, kReachPx), by_yy(width, kReachPx);
  for (int y = 0; y < image.rows; ++y) {
    float *c = by_1.begin(), *cy = by_y.begin(), *cyy = by_yy.begin();
    const auto* middle = image.ptr<float>(y);
    for (int x = 0; x < width; ++x) {
      c[x] = basis.g[0] * middle[x];
      cy[x] = cyy[x] = 0.0F;
    }
    for (int k = 1; k <= kReachPx; ++k) {
      const auto* up = image.ptr<float>(std::max(y - k, 0));
      const auto* down = image.ptr<float>(std::min(y + k, image.rows - 1));
      const float g = basis.g[k], yg = basis.xg[k], yyg = basis.xxg[k];
      for (int x = 0; x < width; ++x) {
        const float sum = up[x] + down[x];
        c[x] += g * sum;
        cy[x] += yg * (down[x] - up[x]);
        cyy[x] += yyg * sum;
      }
    }
    for (PaddedRow* row : {&by_1, &by_y, &by_yy}) row->repeat_ends();
    for (int group = 0; group < width; group += kLanes) {
      const int x = std::min(group, width - kLanes);  // the last four overlap those before
      Float4 one = splat(basis.g[0]) * _mm_loadu_ps(c + x);
      Float4 v = splat(basis.g[0]) * _mm_loadu_ps(cy + x);
      Float4 vv = splat(basis.g[0]) * _mm_loadu_ps(cyy + x);
      Float4 u = _mm_setzero_ps(), uu = u, uv = u;
      for (int k = 1; k <= kReachPx; ++k) {
        const Float4 left = _mm_loadu_ps(c + x - k), right = _mm_loadu_ps(c + x + k);
        const Float4 left_y = _mm_loadu_ps(cy + x - k), right_y = _mm_loadu_ps(cy + x + k);
        const Float4 g = splat(basis.g[k]), xg = splat(basis.xg[k]), xxg = splat(basis.xxg[k]);
        one = one + g * (left + right);
        u = u + xg * (right - left);
        uu = uu + xxg * (left + right);
        v = v + g * (left_y + right_y);
        uv = uv + xg * (right_y - left_y);
        vv = vv + g * (_mm_loadu_ps(cyy + x - k) + _mm_loadu_ps(cyy + x + k));
      }
      const Float4 linear = splat(basis.linear), square = splat(basis.square);
      const Float4 constant = splat(basis.constant_to_square) * one;
      const Float4x4 pixels =
          transposed(v * linear, u * linear, constant + vv * square, constant + uu * square);
      float* out = level.terms.ptr<float>(y) + static_cast<std::ptrdiff_t>(4) * x;
      _mm_storeu_ps(out, pixels.x);
      _mm_storeu_ps(out + 4, pixels.y);
      _mm_storeu_ps(out + 8, pixels.z);
      _mm_storeu_ps(out + 12, pixels.w);
      _mm_storeu_ps(level.mixed.ptr<float>(y) + x, uv * splat(basis.mixed));
    }
  }
  return level;
}

// Of four pixels: the polynomial's terms, a lane a pixel.
struct Terms {
  Float4x4 t;  // b_y, b_x, A_yy, A_xx
  Float4 mixed;
};

Terms terms_at(const PolynomialLevel& level, int x, int y) {
  const float* p = level.terms.ptr<float>(y) + static_cast<std::ptrdiff_t>(4) * x;
  return {
      transposed(_mm_loadu_ps(p), _mm_loadu_ps(p + 4), _mm_loadu_ps(p + 8), _mm_loadu_ps(p + 12)),
      _mm_loadu_ps(level.mixed.ptr<float>(y) + x)};
}

// Bilinear, at four places given by their top left pixels and fractions.
Terms terms_between(const PolynomialLevel& level, const int (&at)[kLanes], Float4 fx, Float4 fy) {
  const Float4 one = splat(1.0F);
  const Float4 w00 = (one - fx) * (one - fy), w10 = fx * (one - fy), w01 = (one - fx) * fy,
               w11 = fx * fy;
  float a[kLanes], b[kLanes], c[kLanes], d[kLanes];
  _mm_storeu_ps(a, w00);
  _mm_storeu_ps(b, w10);
  _mm_storeu_ps(c, w01);
  _mm_storeu_ps(d, w11);
  const int stride = level.mixed.cols;
  const auto* terms = level.terms.ptr<float>(0);
  const auto* mixed = level.mixed.ptr<float>(0);
  Float4 four[kLanes];
  for (int lane = 0; lane < kLanes; ++lane) {
    const float* p = terms + static_cast<std::ptrdiff_t>(4) * at[lane];
    const float* q = p + static_cast<std::ptrdiff_t>(4) * stride;
    four[lane] = splat(a[lane]) * _mm_loadu_ps(p) + splat(b[lane]) * _mm_loadu_ps(p + 4) +
                 splat(c[lane]) * _mm_loadu_ps(q) + splat(d[lane]) * _mm_loadu_ps(q + 4);
  }
  const auto gather = [&](const float* p) {
    return _mm_setr_ps(p[at[0]], p[at[1]], p[at[2]], p[at[3]]);
  };
  return {transposed(four[0], four[1], four[2], four[3]),
          w00 * gather(mixed) + w10 * gather(mixed + 1) + w01 * gather(mixed + stride) +
              w11 * gather(mixed + stride + 1)};
}

// The equations G d = h of each pixel's motion d, as five pictures: with A the mean of both
// polynomials' and db = (b_reference - b_moving) / 2 + A d_before,
//   G = A^T A,   h = A^T db.
struct Equations {
  std::array<cv::Mat, kMoments> moment;  // CV_32F: G_yy, G_xy, G_xx, h_y, h_x
  explicit Equations(cv::Size size) {
    for (cv::Mat& m : moment) m.create(size, CV_32F);
  }
};

float certainty(int at, int size) {
  float value = 1.0F;
  if (at < kBorderPx) value *= kBorderCertainty[at];
  if (at >= size - kBorderPx) value *= kBorderCertainty[size - 1 - at];
  return value;
}

void set_up(const PolynomialLevel& reference, const PolynomialLevel& moving, const cv::Mat& flow,
            Equations& equations) {
  const int width = flow.cols, height = flow.rows;
  std::vector<float> across(static_cast<std::size_t>(width));
  for (int x = 0; x < width; ++x) across[x] = certainty(x, width);
  const __m128i last_x = _mm_set1_epi32(width - 1), last_y = _mm_set1_epi32(height - 1),
                minus_one = _mm_set1_epi32(-1);
  const Float4 half = splat(0.5F), quarter = splat(0.25F);
  for (int y = 0; y < height; ++y) {
    const Float4 down = splat(certainty(y, height));
    const auto* motion = flow.ptr<float>(y);
    for (int group = 0; group < width; group += kLanes) {
      const int x = std::min(group, width - kLanes);
      const Float4 first = _mm_loadu_ps(motion + static_cast<std::ptrdiff_t>(2) * x),
                   last = _mm_loadu_ps(motion + static_cast<std::ptrdiff_t>(2) * x + 4);
      const Float4 dx = _mm_shuffle_ps(first, last, _MM_SHUFFLE(2, 0, 2, 0));
      const Float4 dy = _mm_shuffle_ps(first, last, _MM_SHUFFLE(3, 1, 3, 1));
      const float left = static_cast<float>(x);
      const Floor to_x = floor_of(_mm_setr_ps(left, left + 1, left + 2, left + 3) + dx);
      const Floor to_y = floor_of(splat(static_cast<float>(y)) + dy);
      const __m128i inside = _mm_and_si128(_mm_and_si128(_mm_cmpgt_epi32(to_x.whole, minus_one),
                                                         _mm_cmplt_epi32(to_x.whole, last_x)),
                                           _mm_and_si128(_mm_cmpgt_epi32(to_y.whole, minus_one),
                                                         _mm_cmplt_epi32(to_y.whole, last_y)));
      int at_x[kLanes], at_y[kLanes], at[kLanes];
      _mm_storeu_si128(reinterpret_cast<__m128i*>(at_x), _mm_and_si128(to_x.whole, inside));
      _mm_storeu_si128(reinterpret_cast<__m128i*>(at_y), _mm_and_si128(to_y.whole, inside));
      for (int lane = 0; lane < kLanes; ++lane) at[lane] = at_y[lane] * width + at_x[lane];

      const Terms ref = terms_at(reference, x, y);
      const Terms mov = terms_between(moving, at, to_x.part, to_y.part);
      const Float4 mask = _mm_castsi128_ps(inside);
      // Outside the image the moving polynomial is flat and the reference's own A stands for both.
      Float4 b_y = (ref.t.x - _mm_and_ps(mask, mov.t.x)) * half;
      Float4 b_x = (ref.t.y - _mm_and_ps(mask, mov.t.y)) * half;
      Float4 a_yy = select(mask, (ref.t.z + mov.t.z) * half, ref.t.z);
      Float4 a_xx = select(mask, (ref.t.w + mov.t.w) * half, ref.t.w);
      Float4 a_xy = select(mask, (ref.mixed + mov.mixed) * quarter, ref.mixed * half);
      b_y = b_y + a_yy * dy + a_xy * dx;
      b_x = b_x + a_xy * dy + a_xx * dx;
      const Float4 trust = _mm_loadu_ps(&across[x]) * down;
      b_y = b_y * trust;
      b_x = b_x * trust;
      a_yy = a_yy * trust;
      a_xx = a_xx * trust;
      a_xy = a_xy * trust;
      const auto store = [&](int moment, Float4 v) {
        _mm_storeu_ps(equations.moment[moment].ptr<float>(y) + x, v);
      };
      store(0, a_yy * a_yy + a_xy * a_xy);
      store(1, (a_yy + a_xx) * a_xy);
      store(2, a_xx * a_xx + a_xy * a_xy);
      store(3, a_yy * b_y + a_xy * b_x);
      store(4, a_xy * b_y + a_xx * b_x);
    }
  }
}

// Sums of 21 neighbours along a padded row: 16 + 4 + 1, each from sums of half as many.
void sum_along(const float* padded, int width, std::array<std::vector<float>, 2>& work,
               float* sums) {
  const int n = width + 2 * kHalfWindowPx;
  float *two = work[0].data(), *four = work[1].data();
  for (int i = 0; i + 1 < n; ++i) two[i] = padded[i] + padded[i + 1];
  for (int i = 0; i + 3 < n; ++i) four[i] = two[i] + two[i + 2];
  float* eight = two;
  for (int i = 0; i + 7 < n; ++i) eight[i] = four[i] + four[i + 4];
  for (int i = 0; i < width; ++i)
    sums[i] = eight[i] + eight[i + 8] + four[i + 16] + padded[i + kWindowPx - 1];
}

// The motion that the equations of the window around each pixel have in common.
void solve(const Equations& equations, cv::Mat& flow) {
  static_assert(kWindowPx == 16 + 4 + 1);
  const int width = flow.cols, height = flow.rows;
  const auto clamped = [&](int y) { return std::clamp(y, 0, height - 1); };
  // Running sums down the columns, in double: what is added is taken off again without a trace.
  std::array<std::vector<double>, kMoments> column;
  for (int m = 0; m < kMoments; ++m) {
    column[m].assign(static_cast<std::size_t>(width), 0.0);
    for (int k = -kHalfWindowPx; k <= kHalfWindowPx; ++k) {
      const auto* row = equations.moment[m].ptr<float>(clamped(k));
      for (int x = 0; x < width; ++x) column[m][x] += row[x];
    }
  }
  PaddedRow padded(width, kHalfWindowPx);
  std::array<std::vector<float>, 2> work;
  for (auto& w : work) w.resize(width + 2 * static_cast<std::size_t>(kHalfWindowPx));
  std::array<std::vector<float>, kMoments> sum;
  for (auto& s : sum) s.resize(static_cast<std::size_t>(width));
  constexpr float kMean = 1.0F / (kWindowPx * kWindowPx);
  for (int y = 0; y < height; ++y) {
    for (int m = 0; m < kMoments; ++m) {
      double* c = column[m].data();
      float* row = padded.begin();
      for (int x = 0; x < width; ++x) row[x] = static_cast<float>(c[x]);
      padded.repeat_ends();
      sum_along(row - kHalfWindowPx, width, work, sum[m].data());
      const auto* enters = equations.moment[m].ptr<float>(clamped(y + kHalfWindowPx + 1));
      const auto* leaves = equations.moment[m].ptr<float>(clamped(y - kHalfWindowPx));
      for (int x = 0; x < width; ++x)
        c[x] += static_cast<double>(enters[x]) - static_cast<double>(leaves[x]);
    }
    auto* motion = flow.ptr<float>(y);
    const float *yy = sum[0].data(), *xy = sum[1].data(), *xx = sum[2].data();
    const float *hy = sum[3].data(), *hx = sum[4].data();
    for (int x = 0; x < width; ++x) {
      const float g_yy = kMean * yy[x], g_xy = kMean * xy[x], g_xx = kMean * xx[x];
      const float h_y = kMean * hy[x], h_x = kMean * hx[x];
      const float inverse = 1.0F / (g_yy * g_xx - g_xy * g_xy + kRegular);
      motion[2 * x] = (g_yy * h_x - g_xy * h_y) * inverse;
      motion[2 * x + 1] = (g_xx * h_y - g_xy * h_x) * inverse;
    }
  }
}

}  // namespace

PolynomialPyramid expand_polynomials(const cv::Mat& image) {
  check(image.type() == CV_8U && image.cols >= kLanes && image.rows >= kLanes,
        "polynomials: expected an 8-bit gray image of at least {} x {}, found type {}, {} x {}",
        kLanes, kLanes, image.type(), image.cols, image.rows);
  static const Basis basis;
  PolynomialPyramid pyramid;
  for (int level = 0; level <= kHalvings; ++level) {
    const double scale = std::ldexp(1.0, -level);
    if (level > 0 && (image.cols * scale < kSmallestPx || image.rows * scale < kSmallestPx)) break;
    // From the full image each time, blurred by what the smaller one cannot hold.
    const double sigma = (1.0 / scale - 1.0) * 0.5;
    const int side = std::max(cvRound(sigma * 5.0) | 1, 3);
    cv::Mat smooth, small;
    image.convertTo(smooth, CV_32F);
    cv::GaussianBlur(smooth, smooth, {side, side}, sigma, sigma);
    cv::resize(smooth, small, {cvRound(image.cols * scale), cvRound(image.rows * scale)}, 0, 0,
               cv::INTER_LINEAR);
    pyramid.push_back(expanded(small, basis));
  }
  return pyramid;
}

cv::Mat farneback(const PolynomialPyramid& reference, const PolynomialPyramid& moving,
                  const cv::Mat& initial) {
  check(!reference.empty() && reference.size() == moving.size() &&
            reference[0].mixed.size() == moving[0].mixed.size() &&
            reference[0].mixed.size() == initial.size() && initial.type() == CV_32FC2,
        "optical flow: the images and the initial flow differ in size");
  cv::Mat flow;
  for (std::size_t level = reference.size(); level-- > 0;) {
    const cv::Size size = reference[level].mixed.size();
    if (level + 1 < reference.size()) {
      cv::resize(flow, flow, size, 0, 0, cv::INTER_LINEAR);
      flow *= 2.0;
    } else if (level > 0) {
      cv::resize(initial, flow, size, 0, 0, cv::INTER_AREA);
      flow *= std::ldexp(1.0, -static_cast<int>(level));
    } else {
      flow = initial.clone();
    }
    Equations equations(size);
    for (int iteration = 0; iteration < kIterations; ++iteration) {
      set_up(reference[level], moving[level], flow, equations);
      solve(equations, flow);
    }
  }
  return flow;
}

}  // namespace rugae
