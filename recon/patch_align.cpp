#include "recon/patch_align.h"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/float8.h"

namespace rugae {
namespace {

constexpr double kNegligiblePx = 0.01;    // a step that moves no corner further is the end
constexpr double kNegligibleGain = 1e-3;  // nor one that lowers the error by a smaller share
constexpr int kCoarsestWidthPx = 80;
constexpr int kHalvings = 4;
constexpr double kMinOverlapPx = 100.0;
constexpr double kMinTexture = 1e-8;  // squared gradient a pixel that fixes each parameter

// x -> centred coordinates divided by half the width: the six parameters have one scale.
struct Normalizer {
  double cx, cy, scale;
  explicit Normalizer(const cv::Size& size)
      : cx(0.5 * size.width), cy(0.5 * size.height), scale(2.0 / size.width) {}
};

// The reference with its gradient (central differences), interleaved and filled up to four: one
// bilinear look-up gives all three.
cv::Mat with_gradients(const cv::Mat& image) {
  cv::Mat gx, gy, all;
  const cv::Mat kernel = (cv::Mat_<float>(1, 3) << -0.5F, 0.0F, 0.5F);
  cv::sepFilter2D(image, gx, CV_32F, kernel, cv::Mat::ones(1, 1, CV_32F));
  cv::sepFilter2D(image, gy, CV_32F, cv::Mat::ones(1, 1, CV_32F), kernel);
  cv::merge(std::vector<cv::Mat>{image, gx, gy, image}, all);
  return all;
}

struct Sums {
  double squared_error = 0.0, overlap = 0.0;
  double b[6] = {};
  double a[21] = {};  // upper triangle by rows
};

// What the pixels of a row add up to, four at a time, with r the residual, (gx, gy) the gradient
// and u the place along the row. v, the row's own place, is the same for all of them.
struct RowSums {
  Float4 rr = _mm_setzero_ps();
  Float4 r_gx[2] = {rr, rr}, r_gy[2] = {rr, rr};                                     // times 1, u
  Float4 gx_gx[3] = {rr, rr, rr}, gx_gy[3] = {rr, rr, rr}, gy_gy[3] = {rr, rr, rr};  // 1, u, u^2

  void add(Float4 r, Float4 gx, Float4 gy, Float4 u) {
    rr = rr + r * r;
    const Float4 ugx = u * gx, ugy = u * gy;
    r_gx[0] = r_gx[0] + r * gx;
    r_gx[1] = r_gx[1] + r * ugx;
    r_gy[0] = r_gy[0] + r * gy;
    r_gy[1] = r_gy[1] + r * ugy;
    gx_gx[0] = gx_gx[0] + gx * gx;
    gx_gx[1] = gx_gx[1] + gx * ugx;
    gx_gx[2] = gx_gx[2] + ugx * ugx;
    gx_gy[0] = gx_gy[0] + gx * gy;
    gx_gy[1] = gx_gy[1] + gx * ugy;
    gx_gy[2] = gx_gy[2] + ugx * ugy;
    gy_gy[0] = gy_gy[0] + gy * gy;
    gy_gy[1] = gy_gy[1] + gy * ugy;
    gy_gy[2] = gy_gy[2] + ugy * ugy;
  }
};

// With j = (gx u, gx v, gx, gy u, gy v, gy): b = sum j r, a = sum j j^T.
Sums sums_of(const RowSums& row, double v, int overlap) {
  Sums sums;
  sums.squared_error = sum_of(row.rr);
  sums.overlap = overlap;
  const double power_of_v[2] = {1.0, v};
  // Each parameter is a gradient times u, v or 1.
  constexpr int kTimesU[3] = {1, 0, 0}, kTimesV[3] = {0, 1, 0};
  const auto entry = [&](const Float4(&s)[3], int i, int l) {
    return sum_of(s[kTimesU[i] + kTimesU[l]]) * power_of_v[kTimesV[i]] * power_of_v[kTimesV[l]];
  };
  for (int i = 0, k = 0; i < 6; ++i) {
    const Float4(&r_g)[2] = i < 3 ? row.r_gx : row.r_gy;
    sums.b[i] = sum_of(r_g[kTimesU[i % 3]]) * power_of_v[kTimesV[i % 3]];
    for (int l = i; l < 6; ++l, ++k)
      sums.a[k] = entry(l < 3 ? row.gx_gx : i < 3 ? row.gx_gy : row.gy_gy, i % 3, l % 3);
  }
  return sums;
}

// One row of moving pixels. d e / d(a1 a2 tx a3 a4 ty) = grad I_ref . d x' / d(...), with
// x' in pixels = (A_n x_n) / scale + centre and x_n = ((x - cx) scale, (y - cy) scale, 1).
void add_row(const PatchPair& pair, const cv::Mat& reference, const Affine2& ref_from_mov, int y,
             Sums& sums) {
  const Normalizer norm(pair.moving.size());
  const float inverse_scale = static_cast<float>(1.0 / norm.scale);
  const auto* moving = pair.moving.ptr<float>(y);
  const auto* inside = pair.moving_patches.ptr<unsigned char>(y);
  const double py = y + 0.5;
  int overlap = 0, held = 0;
  RowSums row;
  float r[4] = {}, gx[4] = {}, gy[4] = {}, u[4] = {};  // the pixels waiting for their four
  const auto flush = [&] {
    row.add(_mm_loadu_ps(r), _mm_loadu_ps(gx), _mm_loadu_ps(gy), _mm_loadu_ps(u));
    held = 0;
  };
  const int last_x = reference.cols - 2, last_y = reference.rows - 2;
  const std::size_t stride = reference.step1();
  for (int x = 0; x < pair.moving.cols; ++x) {
    if (!inside[x]) continue;
    const double px = x + 0.5;
    const double qx = ref_from_mov(0, 0) * px + ref_from_mov(0, 1) * py + ref_from_mov(0, 2) - 0.5;
    const double qy = ref_from_mov(1, 0) * px + ref_from_mov(1, 1) * py + ref_from_mov(1, 2) - 0.5;
    if (!(qx >= 0.0 && qy >= 0.0 && qx < last_x + 1 && qy < last_y + 1)) continue;
    const int ix = static_cast<int>(qx), iy = static_cast<int>(qy);
    // w(x') is that of the pixel whose area holds x'.
    if (!pair.reference_patches.ptr<unsigned char>(
            static_cast<int>(qy + 0.5))[static_cast<int>(qx + 0.5)])
      continue;
    const float fx = static_cast<float>(qx - ix), fy = static_cast<float>(qy - iy);
    const Float4 w00 = splat((1 - fx) * (1 - fy)), w10 = splat(fx * (1 - fy)),
                 w01 = splat((1 - fx) * fy), w11 = splat(fx * fy);
    // Value and gradient at once.
    const float* p0 = reference.ptr<float>(iy) + static_cast<std::ptrdiff_t>(4) * ix;
    const float* p1 = p0 + stride;
    float all[4];
    _mm_storeu_ps(all, w00 * _mm_loadu_ps(p0) + w10 * _mm_loadu_ps(p0 + 4) +
                           w01 * _mm_loadu_ps(p1) + w11 * _mm_loadu_ps(p1 + 4));
    r[held] = all[0] - moving[x];
    gx[held] = all[1] * inverse_scale;
    gy[held] = all[2] * inverse_scale;
    u[held] = static_cast<float>((px - norm.cx) * norm.scale);
    ++overlap;
    if (++held == 4) flush();
  }
  for (int i = held; i < 4; ++i) r[i] = gx[i] = gy[i] = 0.0F;
  if (held > 0) flush();
  sums = sums_of(row, (py - norm.cy) * norm.scale, overlap);
}

PatchCost cost_at(const PatchPair& pair, const cv::Mat& reference, const Affine2& ref_from_mov) {
  std::vector<Sums> rows(static_cast<std::size_t>(pair.moving.rows));
  tbb::parallel_for(tbb::blocked_range<int>(0, pair.moving.rows, 32), [&](const auto& range) {
    for (int y = range.begin(); y < range.end(); ++y)
      add_row(pair, reference, ref_from_mov, y, rows[static_cast<std::size_t>(y)]);
  });
  PatchCost cost;
  for (const Sums& row : rows) {  // in order of rows: the same sum for any number of threads
    cost.squared_error += row.squared_error;
    cost.overlap_px += row.overlap;
    for (int i = 0, k = 0; i < 6; ++i) {
      cost.gradient[i] += row.b[i];
      for (int l = i; l < 6; ++l, ++k) cost.normal_matrix(i, l) += row.a[k];
    }
  }
  cost.gradient *= 2.0;
  cost.normal_matrix = Mat6(cost.normal_matrix.selfadjointView<Eigen::Upper>()) * 2.0;
  return cost;
}

// A in normalised coordinates moved by `step`, back in pixels: with N x = (x - c) s,
// A_px = N^-1 (A_n + D) N, so the linear part grows by D's and the translation by D's
// constant over s minus D's linear part times c.
Affine2 moved(const Affine2& affine, const Vec6& step, const Normalizer& norm) {
  const Eigen::Map<const Eigen::Matrix<double, 2, 3, Eigen::RowMajor>> d(step.data());
  Affine2 result = affine;
  result.leftCols<2>() += d.leftCols<2>();
  result.col(2) += d.col(2) / norm.scale - d.leftCols<2>() * Vec2(norm.cx, norm.cy);
  return result;
}

double largest_corner_motion_px(const Affine2& a, const Affine2& b, const cv::Size& size) {
  double largest = 0.0;
  for (const double x : {0.0, static_cast<double>(size.width)}) {
    for (const double y : {0.0, static_cast<double>(size.height)})
      largest = std::max(largest, ((a - b) * Vec3(x, y, 1.0)).norm());
  }
  return largest;
}

PatchPair halved(const PatchPair& pair) {
  const cv::Size size(pair.moving.cols / 2, pair.moving.rows / 2);
  const cv::Rect even(0, 0, 2 * size.width, 2 * size.height);
  PatchPair half;
  cv::resize(pair.reference(even), half.reference, size, 0, 0, cv::INTER_AREA);
  cv::resize(pair.moving(even), half.moving, size, 0, 0, cv::INTER_AREA);
  cv::resize(pair.reference_patches(even), half.reference_patches, size, 0, 0, cv::INTER_NEAREST);
  cv::resize(pair.moving_patches(even), half.moving_patches, size, 0, 0, cv::INTER_NEAREST);
  return half;
}

Affine2 scaled(Affine2 affine, double factor) {
  affine.col(2) *= factor;
  return affine;
}

// Gauss-Newton at one resolution; `px_per_px` full-resolution pixels make one of this.
void descend(const PatchPair& pair, double px_per_px, double stop_mse, int max_iterations,
             AffineFit& fit) {
  const cv::Mat reference = with_gradients(pair.reference);
  const Normalizer norm(pair.moving.size());
  fit.converged = false;
  PatchCost cost = cost_at(pair, reference, fit.ref_from_mov);
  while (cost.overlap_px >= kMinOverlapPx) {
    fit.mse = cost.mse();
    if (fit.mse < stop_mse) fit.converged = true;
    if (fit.converged || fit.iterations >= max_iterations) return;
    ++fit.iterations;
    const Eigen::LDLT<Mat6> solver(cost.normal_matrix);
    if (!(solver.vectorD().minCoeff() > kMinTexture * cost.overlap_px)) return;
    Vec6 step = solver.solve(-cost.gradient);
    bool lowered = false, settled = false;
    for (int halving = 0; halving <= kHalvings && !lowered; ++halving, step *= 0.5) {
      const Affine2 next = moved(fit.ref_from_mov, step, norm);
      const double motion_px =
          px_per_px * largest_corner_motion_px(next, fit.ref_from_mov, pair.moving.size());
      if (motion_px < kNegligiblePx) break;
      const PatchCost trial = cost_at(pair, reference, next);
      lowered = trial.overlap_px >= kMinOverlapPx && trial.mse() < cost.mse();
      if (!lowered) continue;
      settled = trial.mse() > (1.0 - kNegligibleGain) * cost.mse();
      fit.ref_from_mov = next;
      cost = trial;
    }
    if (!lowered || settled) {
      fit.mse = cost.mse();
      fit.converged = true;
      return;
    }
  }
}

}  // namespace

cv::Mat circular_patches(const std::vector<Vec2>& points_px, double radius_px,
                         const cv::Size& size) {
  cv::Mat mask = cv::Mat::zeros(size, CV_8U);
  for (const Vec2& c : points_px) {
    const int top = std::max(0, static_cast<int>(std::floor(c.y() - radius_px)));
    const int bottom = std::min(size.height - 1, static_cast<int>(std::ceil(c.y() + radius_px)));
    for (int y = top; y <= bottom; ++y) {
      const double dy = y + 0.5 - c.y();
      const double half_squared = radius_px * radius_px - dy * dy;
      if (half_squared <= 0.0) continue;
      const double half = std::sqrt(half_squared);
      // Centres strictly within the circle: |x + 0.5 - c| < half.
      const int left = std::max(0, static_cast<int>(std::floor(c.x() - half - 0.5)) + 1);
      const int right =
          std::min(size.width - 1, static_cast<int>(std::ceil(c.x() + half - 0.5)) - 1);
      if (left <= right)
        std::fill(mask.ptr<unsigned char>(y) + left, mask.ptr<unsigned char>(y) + right + 1,
                  static_cast<unsigned char>(255));
    }
  }
  return mask;
}

PatchCost patch_cost(const PatchPair& pair, const Affine2& ref_from_mov) {
  return cost_at(pair, with_gradients(pair.reference), ref_from_mov);
}

AffineFit fit_affine(const PatchPair& pair, const Affine2& start, const AffineFitOptions& options) {
  std::vector<PatchPair> pyramid{pair};
  while (pyramid.back().moving.cols / 2 >= kCoarsestWidthPx)
    pyramid.push_back(halved(pyramid.back()));
  AffineFit fit;
  fit.ref_from_mov = start;
  for (std::size_t level = pyramid.size(); level-- > 0;) {
    const double factor = std::ldexp(1.0, static_cast<int>(level));
    fit.ref_from_mov = scaled(fit.ref_from_mov, 1.0 / factor);
    // Averaging lowers the error of coarse images: only the finest may end by the MSE.
    descend(pyramid[level], factor, level == 0 ? options.stop_mse : 0.0, options.max_iterations,
            fit);
    fit.ref_from_mov = scaled(fit.ref_from_mov, factor);
  }
  return fit;
}

}  // namespace rugae
