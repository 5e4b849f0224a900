#include "recon/dense/sweep.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

namespace rugae {
namespace {

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
/// This share of a window must be seen by both.
constexpr float kMinSeen = 0.6f;
/// Contrast below which texture is rounding and noise, assumed: half a grey level of a hundred,
/// averaged over the four pixels of a frame that a pixel here is made of.
constexpr float kNoiseContrast = 0.0025f;
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

/// A row of the source's texture as the reference would see it on the surface; NaN where the source
/// has none.
void warp_row(const Warp& warp, const cv::Mat& texture, const float* surface, float factor, int y,
              int width, float* u, float* v, float* out) {
  const float row = static_cast<float>(y) + 0.5f;
  for (int x = 0; x < width; ++x) {
    const float column = static_cast<float>(x) + 0.5f, z = surface[x] * factor;
    const float w = z * (warp.m[2][0] * column + warp.m[2][1] * row + warp.m[2][2]) + warp.b[2];
    const float inverse = 1.0f / w;
    // Behind the source: outside its picture.
    u[x] = w > 0.0f
               ? (z * (warp.m[0][0] * column + warp.m[0][1] * row + warp.m[0][2]) + warp.b[0]) *
                         inverse -
                     0.5f
               : -1.0f;
    v[x] = (z * (warp.m[1][0] * column + warp.m[1][1] * row + warp.m[1][2]) + warp.b[1]) * inverse -
           0.5f;
  }
  const float right = static_cast<float>(texture.cols - 1),
              low = static_cast<float>(texture.rows - 1);
  const std::size_t stride = texture.step1();
  const float* data = texture.ptr<float>();
  for (int x = 0; x < width; ++x) {
    if (!(u[x] >= 0.0f && v[x] >= 0.0f && u[x] < right && v[x] < low)) {
      out[x] = kUnknown;
      continue;
    }
    const int left = static_cast<int>(u[x]), top = static_cast<int>(v[x]);
    const float across = u[x] - static_cast<float>(left), down = v[x] - static_cast<float>(top);
    const float* p = data + static_cast<std::size_t>(top) * stride + left;
    const float* q = p + stride;
    const float upper = p[0] + across * (p[1] - p[0]), lower = q[0] + across * (q[1] - q[0]);
    out[x] = upper + down * (lower - upper);
  }
}

/// Sums over windows of what correlation needs: a row's worth of column sums that moves down the
/// picture.
class WindowSums {
 public:
  WindowSums(int width, int radius) : width_(width), radius_(radius) {
    for (auto& sums : columns_) sums.assign(static_cast<std::size_t>(width), 0.0f);
  }

  /// Adds (sign 1) or takes away (-1) a row.
  void add(const float* reference, const float* other, float sign) {
    for (int x = 0; x < width_; ++x) {
      const float a = reference[x], b = other[x];
      const bool both = a == a && b == b;
      const float one = both ? sign : 0.0f, ka = both ? a : 0.0f, kb = both ? b : 0.0f;
      columns_[0][x] += one;
      columns_[1][x] += one * ka;
      columns_[2][x] += one * kb;
      columns_[3][x] += one * ka * ka;
      columns_[4][x] += one * kb * kb;
      columns_[5][x] += one * ka * kb;
    }
  }

  /// Correlation of the windows around the middle row.
  void correlate(float* out) const {
    std::array<float, kSums> s{};
    const auto move = [&](int x, float sign) {
      for (int i = 0; i < kSums; ++i) s[i] += sign * columns_[i][x];
    };
    const float side = static_cast<float>(2 * radius_ + 1), least = kMinSeen * side * side;
    for (int x = 0; x < std::min(radius_, width_); ++x) move(x, 1.0f);
    for (int x = 0; x < width_; ++x) {
      if (x + radius_ < width_) move(x + radius_, 1.0f);
      if (x - radius_ - 1 >= 0) move(x - radius_ - 1, -1.0f);
      const float n = s[0];
      if (!(n >= least)) {
        out[x] = kUnknown;
        continue;
      }
      const float inverse = 1.0f / n, noise = kNoiseContrast * kNoiseContrast * n;
      const float aa = std::max(s[3] - s[1] * s[1] * inverse, 0.0f) + noise;
      const float bb = std::max(s[4] - s[2] * s[2] * inverse, 0.0f) + noise;
      out[x] = (s[5] - s[1] * s[2] * inverse) / std::sqrt(aa * bb);
    }
  }

 private:
  static constexpr int kSums = 6;
  int width_, radius_;
  std::array<std::vector<float>, kSums> columns_;
};

/// Mean of the better half of the known values, at least two; NaN with fewer. Reorders them.
float better_half(float* values, int count) {
  int known = 0;
  for (int i = 0; i < count; ++i)
    if (values[i] == values[i]) values[known++] = values[i];
  if (known < 2) return kUnknown;
  const int half = std::max(2, (known + 1) / 2);
  // Few values: sorting by insertion is the fastest.
  for (int i = 1; i < known; ++i) {
    const float value = values[i];
    int j = i;
    for (; j > 0 && values[j - 1] < value; --j) values[j] = values[j - 1];
    values[j] = value;
  }
  float sum = 0.0f;
  for (int i = 0; i < half; ++i) sum += values[i];
  return sum / static_cast<float>(half);
}

/// Correlation of all pixels with one source at one place of the surface.
void correlate(const StereoImage& reference, const StereoImage& source, const Warp& warp,
               const cv::Mat& surface, float factor, int radius, cv::Mat& warped, cv::Mat& scores) {
  const int width = reference.grid.width, height = reference.grid.height;
  std::vector<float> u(static_cast<std::size_t>(width)), v(u.size());
  WindowSums sums(width, radius);
  const auto take = [&](int y, float sign) {
    sums.add(reference.texture.ptr<float>(y), warped.ptr<float>(y), sign);
  };
  for (int y = -radius; y < height; ++y) {
    if (y + radius < height) {
      warp_row(warp, source.texture, surface.ptr<float>(y + radius), factor, y + radius, width,
               u.data(), v.data(), warped.ptr<float>(y + radius));
      take(y + radius, 1.0f);
    }
    if (y < 0) continue;
    if (y - radius - 1 >= 0) take(y - radius - 1, -1.0f);
    sums.correlate(scores.ptr<float>(y));
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
  std::vector<Warp> warps;
  std::vector<cv::Mat> scores;
  for (const SweepSource& source : sources) {
    warps.push_back(warp_between(reference.grid, source.image->grid, source.source_from_reference));
    scores.emplace_back(volume.size, CV_32F);
  }
  cv::Mat warped(volume.size, CV_32F);
  std::vector<float> values(sources.size());
  for (int k = -range.reach; k <= range.reach; ++k) {
    const auto factor = static_cast<float>(std::exp(range.step_ln * k));
    for (std::size_t s = 0; s < sources.size(); ++s)
      correlate(reference, *sources[s].image, warps[s], surface, factor, radius_px, warped,
                scores[s]);
    for (int y = 0; y < volume.size.height; ++y)
      for (int x = 0; x < volume.size.width; ++x) {
        for (std::size_t s = 0; s < sources.size(); ++s) values[s] = scores[s].at<float>(y, x);
        volume.at(x, y)[k + range.reach] =
            better_half(values.data(), static_cast<int>(values.size()));
      }
  }
  return volume;
}

}  // namespace rugae
