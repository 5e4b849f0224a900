#include "recon/polynomials.h"

#include <Eigen/LU>
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

constexpr int kHalvings = 2;  // the start is within a few pixels: a taller pyramid adds nothing
constexpr int kSmallestPx = 32;
constexpr int kReachPx = 7;  // of the polynomial's neighbourhood
constexpr double kSigmaPx = 1.5;
constexpr int kLanes = 4;

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

// The correlations of the image with the basis, first down the columns, then along the rows.
[[gnu::target_clones("avx2", "default")]] PolynomialLevel expanded(const cv::Mat& image,
                                                                   const Basis& basis) {
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

}  // namespace rugae
