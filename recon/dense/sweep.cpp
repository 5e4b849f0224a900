#include "recon/dense/sweep.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

#include "core/float4.h"
#include "recon/dense/window_correlation.h"

namespace rugae {
namespace {

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
constexpr int kMeanStride = 8;  // pixels looked at for motion_px, each way

/// pixel_source = (z m x + b) / its last, for the homogeneous pixel x of the reference.
struct Warp {
  float m[3][3], b[3];
};

Warp warp_between(const PinholeGrid& reference, const PinholeGrid& source,
                  const Rigid3& source_from_reference) {
  Mat3 k_source, k_reference;
  k_source << source.fx, 0.0, source.cx, 0.0, source.fy, source.cy, 0.0, 0.0, 1.0;
  k_reference << reference.fx, 0.0, reference.cx, 0.0, reference.fy, reference.cy, 0.0, 0.0, 1.0;
  const Mat3 m =
      k_source * source_from_reference.rotation.toRotationMatrix() * k_reference.inverse();
  const Vec3 b = k_source * source_from_reference.translation;
  Warp warp;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) warp.m[r][c] = static_cast<float>(m(r, c));
    warp.b[r] = static_cast<float>(b[r]);
  }
  return warp;
}

Float4 truncated(Float4 v) { return _mm_cvtepi32_ps(_mm_cvttps_epi32(v)); }

/// A row of the source's texture as the reference would see it on the surface, in strips of which
/// the second begins at column `width`; NaN where the source has none.
void warp_row(const Warp& warp, const cv::Mat& texture, const float* surface, float factor, int y,
              int width, float* out) {
  const Float4 row = splat(static_cast<float>(y) + 0.5f), zero = _mm_setzero_ps();
  const Float4 right = splat(static_cast<float>(texture.cols - 1));
  const Float4 low = splat(static_cast<float>(texture.rows - 1));
  const std::size_t step = texture.step1();
  const Float4 stride = splat(static_cast<float>(step));
  const float* data = texture.ptr<float>();
  const auto begin = [&](int k) { return static_cast<float>(k * width) + 0.5f; };
  const Float4 first = _mm_setr_ps(begin(0), begin(1), begin(2), begin(3));
  for (int x = 0; x < width; ++x) {
    const Float4 column = splat(static_cast<float>(x)) + first;
    const Float4 z = _mm_loadu_ps(surface + 4 * x) * splat(factor);
    const auto along = [&](int r) {
      return z * (splat(warp.m[r][0]) * column + splat(warp.m[r][1]) * row + splat(warp.m[r][2])) +
             splat(warp.b[r]);
    };
    const Float4 w = along(2), inverse = splat(1.0f) / w;
    const Float4 u = along(0) * inverse - splat(0.5f), v = along(1) * inverse - splat(0.5f);
    // Behind the source is outside of its picture; comparisons with NaN fail.
    const Float4 inside = _mm_and_ps(
        _mm_and_ps(above(w, zero), _mm_and_ps(_mm_cmpge_ps(u, zero), _mm_cmpge_ps(v, zero))),
        _mm_and_ps(above(right, u), above(low, v)));
    if (!any(inside)) {
      _mm_storeu_ps(out + 4 * x, splat(kUnknown));
      continue;
    }
    // Whole numbers up to 2^24 are exact; none is negative, so that truncation is the floor.
    const Float4 left = truncated(_mm_and_ps(inside, u)), top = truncated(_mm_and_ps(inside, v));
    alignas(16) int begin_at[4];
    _mm_store_si128(reinterpret_cast<__m128i*>(begin_at), _mm_cvttps_epi32(top * stride + left));
    Float4 around[4];  // of each place: upper left, upper right, lower left, lower right
    for (int k = 0; k < 4; ++k) {
      const float* p = data + begin_at[k];
      around[k] = two_and_two(p, p + step);
    }
    const Float4 across = _mm_and_ps(inside, u) - left, down = _mm_and_ps(inside, v) - top;
    const Float4x4 c = transposed(around[0], around[1], around[2], around[3]);
    const Float4 upper = c.x + across * (c.y - c.x);
    const Float4 lower = c.z + across * (c.w - c.z);
    _mm_storeu_ps(out + 4 * x, select(inside, upper + down * (lower - upper), splat(kUnknown)));
  }
}

/// Correlation of all places with one source at one place of the surface; all but the source's
/// texture in strips.
void correlate(const cv::Mat& reference, const cv::Mat& source, const Warp& warp,
               const cv::Mat& surface, float factor, int radius, WindowCorrelation& windows,
               cv::Mat& warped, cv::Mat& scores) {
  const int height = reference.rows;
  const auto row = [&](int y) {
    return y >= 0 && y < height ? RowPair{reference.ptr<float>(y), warped.ptr<float>(y)}
                                : windows.nowhere();
  };
  windows.reset();
  for (int y = -radius; y < height; ++y) {
    if (y + radius < height)
      warp_row(warp, source, surface.ptr<float>(y + radius), factor, y + radius, warped.cols,
               warped.ptr<float>(y + radius));
    windows.slide(row(y + radius), row(y - radius - 1));
    if (y >= 0) windows.correlate(scores.ptr<float>(y));
  }
}

}  // namespace

double motion_px(const StereoImage& reference, const SweepSource& source, const cv::Mat& surface) {
  std::vector<double> motions;
  for (int y = kMeanStride / 2; y < surface.rows; y += kMeanStride)
    for (int x = kMeanStride / 2; x < surface.cols; x += kMeanStride) {
      const Vec3 p = source.source_from_reference *
                     (static_cast<double>(surface.at<float>(y, x)) * reference.grid.ray(x, y));
      if (!(p.z() > 0.0)) continue;
      // d p / d ln z is the part of p that scales: p - translation.
      const Vec3 d = p - source.source_from_reference.translation;
      const PinholeGrid& grid = source.image->grid;
      motions.push_back(std::hypot(grid.fx * (d.x() - p.x() / p.z() * d.z()) / p.z(),
                                   grid.fy * (d.y() - p.y() / p.z() * d.z()) / p.z()));
    }
  if (motions.empty()) return 0.0;
  const auto middle = motions.begin() + static_cast<std::ptrdiff_t>(motions.size() / 2);
  std::nth_element(motions.begin(), middle, motions.end());
  return *middle;
}

ScoreVolume sweep(const StereoImage& reference, const std::vector<SweepSource>& sources,
                  const cv::Mat& surface, const SweepRange& range, int radius_px) {
  ScoreVolume volume;
  volume.size = reference.grid.size();
  volume.count = range.count();
  volume.scores.assign(static_cast<std::size_t>(volume.size.area()) * volume.count, kUnknown);
  const cv::Mat texture = strips_of(reference.texture), wall = strips_of(surface);
  std::vector<Warp> warps;
  std::vector<cv::Mat> scores;
  for (const SweepSource& source : sources) {
    warps.push_back(warp_between(reference.grid, source.image->grid, source.source_from_reference));
    scores.emplace_back(texture.size(), CV_32FC4);
  }
  cv::Mat warped(texture.size(), CV_32FC4);
  WindowCorrelation windows(texture.cols, radius_px);
  std::vector<const float*> rows(sources.size());
  std::vector<cv::Vec4f> means(static_cast<std::size_t>(texture.cols));
  for (int k = -range.reach; k <= range.reach; ++k) {
    const auto factor = static_cast<float>(std::exp(range.step_ln * k));
    for (std::size_t s = 0; s < sources.size(); ++s)
      correlate(texture, sources[s].image->texture, warps[s], wall, factor, radius_px, windows,
                warped, scores[s]);
    for (int y = 0; y < volume.size.height; ++y) {
      for (std::size_t s = 0; s < sources.size(); ++s) rows[s] = scores[s].ptr<float>(y);
      better_half(rows, texture.cols, means.front().val);
      for (int strip = 0; strip < 4; ++strip) {
        const int begin = strip * texture.cols;
        for (int x = begin; x < std::min(begin + texture.cols, volume.size.width); ++x)
          volume.at(x, y)[k + range.reach] = means[x - begin][strip];
      }
    }
  }
  return volume;
}

}  // namespace rugae
