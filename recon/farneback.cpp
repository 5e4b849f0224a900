#include "recon/farneback.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "core/check.h"
#include "core/float4.h"
#include "recon/padded_row.h"

namespace rugae {
namespace {

constexpr int kIterations = 3;
constexpr int kWindowPx = 21, kHalfWindowPx = kWindowPx / 2;
constexpr float kRegular = 1e-3F;  // added to the determinant: no texture, no motion
constexpr int kLanes = 4;
constexpr int kMoments = 5;  // of a pixel's equations

// Certainty of the polynomials near the border, whose neighbourhood is cut off.
constexpr int kBorderPx = 5;
constexpr std::array<float, kBorderPx> kBorderCertainty = {0.14F, 0.14F, 0.4472F, 0.4472F, 0.4472F};

// Of four pixels: the polynomial's terms, a lane a pixel.
struct Terms {
  Float4x4 t;  // b_y, b_x, A_yy, A_xx
  Float4 mixed;
};

[[gnu::always_inline]] inline Terms terms_at(const PolynomialLevel& level, int x, int y) {
  const float* p = level.terms.ptr<float>(y) + static_cast<std::ptrdiff_t>(4) * x;
  return {
      transposed(_mm_loadu_ps(p), _mm_loadu_ps(p + 4), _mm_loadu_ps(p + 8), _mm_loadu_ps(p + 12)),
      _mm_loadu_ps(level.mixed.ptr<float>(y) + x)};
}

// Bilinear, at four places given by their top left pixels and fractions.
[[gnu::always_inline]] inline Terms terms_between(const PolynomialLevel& level,
                                                  const int (&at)[kLanes], Float4 fx, Float4 fy) {
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

// The equations G d = h of each pixel's motion d, row by row: with A the mean of both polynomials'
// and db = (b_reference - b_moving) / 2 + A d_before,
//   G = A^T A,   h = A^T db.
// Of all rows those are held that some window still needs: they stay in the processor's cache.
class Equations {
 public:
  explicit Equations(int width) : width_(width), values_(kMoments * kHeld * width_) {}
  /// A row of one moment: G_yy, G_xy, G_xx, h_y, h_x.
  float* row(int y, int moment) {
    return values_.data() + (static_cast<std::size_t>(y % kHeld) * kMoments + moment) * width_;
  }

 private:
  static constexpr std::size_t kHeld = kWindowPx + 1;  // the row that enters, and that which leaves
  std::size_t width_;
  std::vector<float> values_;
};

float certainty(int at, int size) {
  float value = 1.0F;
  if (at < kBorderPx) value *= kBorderCertainty[at];
  if (at >= size - kBorderPx) value *= kBorderCertainty[size - 1 - at];
  return value;
}

// Those of row y; `across` is the certainty of each of its pixels.
[[gnu::always_inline]] inline void set_up(const PolynomialLevel& reference,
                                          const PolynomialLevel& moving, const cv::Mat& flow, int y,
                                          const std::vector<float>& across, Equations& equations) {
  const int width = flow.cols, height = flow.rows;
  const __m128i last_x = _mm_set1_epi32(width - 1), last_y = _mm_set1_epi32(height - 1),
                minus_one = _mm_set1_epi32(-1);
  const Float4 half = splat(0.5F), quarter = splat(0.25F);
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
    const __m128i inside = _mm_and_si128(
        _mm_and_si128(_mm_cmpgt_epi32(to_x.whole, minus_one), _mm_cmplt_epi32(to_x.whole, last_x)),
        _mm_and_si128(_mm_cmpgt_epi32(to_y.whole, minus_one), _mm_cmplt_epi32(to_y.whole, last_y)));
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
      _mm_storeu_ps(equations.row(y, moment) + x, v);
    };
    store(0, a_yy * a_yy + a_xy * a_xy);
    store(1, (a_yy + a_xx) * a_xy);
    store(2, a_xx * a_xx + a_xy * a_xy);
    store(3, a_yy * b_y + a_xy * b_x);
    store(4, a_xy * b_y + a_xx * b_x);
  }
}

// Sums of 21 neighbours along a padded row: 16 + 4 + 1, each from sums of half as many.
[[gnu::always_inline]] inline void sum_along(const float* padded, int width,
                                             std::array<std::vector<float>, 2>& work, float* sums) {
  const int n = width + 2 * kHalfWindowPx;
  float *two = work[0].data(), *four = work[1].data();
  for (int i = 0; i + 1 < n; ++i) two[i] = padded[i] + padded[i + 1];
  for (int i = 0; i + 3 < n; ++i) four[i] = two[i] + two[i + 2];
  float* eight = two;
  for (int i = 0; i + 7 < n; ++i) eight[i] = four[i] + four[i + 4];
  for (int i = 0; i < width; ++i)
    sums[i] = eight[i] + eight[i + 8] + four[i + 16] + padded[i + kWindowPx - 1];
}

// What one iteration knows between two rows.
struct Iteration {
  const PolynomialLevel &reference, &moving;
  cv::Mat& flow;
  std::vector<float> across;  // certainty of a row's pixels
  Equations equations;
  // Running sums down the columns, in double: what is added is taken off again without a trace.
  std::array<std::vector<double>, kMoments> column;
  std::array<std::vector<float>, kMoments> sum;  // over the windows of a row
  PaddedRow padded;
  std::array<std::vector<float>, 2> work;

  Iteration(const PolynomialLevel& from, const PolynomialLevel& to, cv::Mat& motion)
      : reference(from),
        moving(to),
        flow(motion),
        across(static_cast<std::size_t>(motion.cols)),
        equations(motion.cols),
        padded(motion.cols, kHalfWindowPx) {
    for (int x = 0; x < motion.cols; ++x) across[x] = certainty(x, motion.cols);
    for (auto& c : column) c.assign(across.size(), 0.0);
    for (auto& s : sum) s.resize(across.size());
    for (auto& w : work) w.resize(across.size() + 2 * static_cast<std::size_t>(kHalfWindowPx));
  }
};

// In row y, after the rows above it, the motion that the equations of the window around each pixel
// have in common takes the place of the motion they were set up with. That of kLead rows below must
// be what the iteration before left.
constexpr int kLead = kHalfWindowPx + 1;
[[gnu::target_clones("avx2", "default")]] void improve(Iteration& at, int y) {
  static_assert(kWindowPx == 16 + 4 + 1);
  const int width = at.flow.cols, height = at.flow.rows;
  const int entering = std::min(y + kLead, height - 1), leaving = std::max(y - kHalfWindowPx, 0);
  if (y == 0) {
    for (int row = 0; row < std::min(kLead, height); ++row)
      set_up(at.reference, at.moving, at.flow, row, at.across, at.equations);
    for (int m = 0; m < kMoments; ++m)
      for (int k = -kHalfWindowPx; k <= kHalfWindowPx; ++k) {
        const float* row = at.equations.row(std::clamp(k, 0, height - 1), m);
        for (int x = 0; x < width; ++x) at.column[m][x] += row[x];
      }
  }
  if (y + kLead < height)
    set_up(at.reference, at.moving, at.flow, y + kLead, at.across, at.equations);
  for (int m = 0; m < kMoments; ++m) {
    double* c = at.column[m].data();
    float* row = at.padded.begin();
    for (int x = 0; x < width; ++x) row[x] = static_cast<float>(c[x]);
    at.padded.repeat_ends();
    sum_along(row - kHalfWindowPx, width, at.work, at.sum[m].data());
    const float *enters = at.equations.row(entering, m), *leaves = at.equations.row(leaving, m);
    for (int x = 0; x < width; ++x)
      c[x] += static_cast<double>(enters[x]) - static_cast<double>(leaves[x]);
  }
  auto* motion = at.flow.ptr<float>(y);
  const float *yy = at.sum[0].data(), *xy = at.sum[1].data(), *xx = at.sum[2].data();
  const float *hy = at.sum[3].data(), *hx = at.sum[4].data();
  constexpr float kMean = 1.0F / (kWindowPx * kWindowPx);
  for (int x = 0; x < width; ++x) {
    const float g_yy = kMean * yy[x], g_xy = kMean * xy[x], g_xx = kMean * xx[x];
    const float h_y = kMean * hy[x], h_x = kMean * hx[x];
    const float inverse = 1.0F / (g_yy * g_xx - g_xy * g_xy + kRegular);
    motion[2 * x] = (g_yy * h_x - g_xy * h_y) * inverse;
    motion[2 * x + 1] = (g_xx * h_y - g_xy * h_x) * inverse;
  }
}

// All iterations at once, each as far below the next as that needs: what they read of the
// polynomials is still in the processor's cache.
void iterate(const PolynomialLevel& reference, const PolynomialLevel& moving, cv::Mat& flow) {
  std::vector<Iteration> iterations(kIterations, Iteration(reference, moving, flow));
  for (int step = 0; step < flow.rows + (kIterations - 1) * kLead; ++step)
    for (int i = 0; i < kIterations; ++i) {
      const int y = step - i * kLead;
      if (y >= 0 && y < flow.rows) improve(iterations[i], y);
    }
}

}  // namespace

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
    iterate(reference[level], moving[level], flow);
  }
  return flow;
}

}  // namespace rugae
