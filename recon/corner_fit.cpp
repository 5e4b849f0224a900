#include "recon/corner_fit.h"

#include <ceres/tiny_solver.h>
#include <ceres/tiny_solver_autodiff_function.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/srgb.h"

namespace rugae {
namespace {

constexpr double kReachShare = 0.5;           // of the way to the next corner
constexpr int kLeastHalf = 2, kMostHalf = 9;  // of the window, px
constexpr double kFocus = 0.7;          // deviation of the pixels' weights, of half the window
constexpr double kSlopeWeight = 0.3;    // of a slope of the light of 1 a pixel, against contrast 1
constexpr int kLeastSpan = 8;           // of grey levels: below it there is noise alone
constexpr double kMostResidual = 0.35;  // RMS, of the contrast
constexpr double kLeastSine = 0.17;     // of the angle between the lines: 10 degrees

// Where the model is looked at within a pixel: what a pixel sees is a mean over its area. Without
// that a sharp edge along the pixel grid would lead astray by a tenth of a pixel.
constexpr double kWithinPixel[] = {-1.0 / 3.0, 0.0, 1.0 / 3.0};

enum Parameter { kX, kY, kAcross, kDown, kWidth, kMean, kContrast, kTone, kSlopeX, kSlopeY };
constexpr int kParameters = 10;

// The window's pixels relative to its middle, linear light over half its span.
struct Window {
  struct Pixel {
    double x, y, value, weight;
  };
  std::vector<Pixel> pixels;

  using Scalar = double;
  int NumResiduals() const { return static_cast<int>(pixels.size()) + 2; }
  template <typename T>
  bool operator()(const T* p, T* residuals) const {
    using std::cos, std::sin, std::tanh;
    const T c1 = cos(p[kAcross]), s1 = sin(p[kAcross]), c2 = cos(p[kDown]), s2 = sin(p[kDown]);
    int k = 0;
    for (const Pixel& at : pixels) {
      T mean_e(0.0);
      for (const double sub_y : kWithinPixel)
        for (const double sub_x : kWithinPixel) {
          const T x = at.x + sub_x - p[kX], y = at.y + sub_y - p[kY];
          mean_e += tanh((c1 * y - s1 * x) / p[kWidth]) * tanh((c2 * y - s2 * x) / p[kWidth]);
        }
      mean_e *= 1.0 / (std::size(kWithinPixel) * std::size(kWithinPixel));
      const T light = 1.0 + p[kSlopeX] * at.x + p[kSlopeY] * at.y;
      const T value = light * (p[kMean] + mean_e * (p[kContrast] + mean_e * p[kTone]));
      residuals[k++] = at.weight * (value - at.value);
    }
    // A few pixels alone cannot tell a slope of the light from squares of unlike brightness.
    residuals[k++] = kSlopeWeight * p[kSlopeX];
    residuals[k++] = kSlopeWeight * p[kSlopeY];
    return true;
  }
};

// Where a camera's curve is not sRGB's the model's q makes up for it.
double linear_from_level(int level) { return linear_from_srgb(level / 255.0); }

// Empty where there is no contrast.
Window cut_window(const cv::Mat& gray, int middle_x, int middle_y, int half) {
  Window window;
  int darkest = 255, brightest = 0;
  for (int y = -half; y <= half; ++y)
    for (int x = -half; x <= half; ++x) {
      const int column = middle_x + x, row = middle_y + y;
      if (column < 0 || row < 0 || column >= gray.cols || row >= gray.rows) continue;
      const int level = gray.at<unsigned char>(row, column);
      darkest = std::min(darkest, level);
      brightest = std::max(brightest, level);
      const double apart = kFocus * half;
      window.pixels.push_back({double(x), double(y), linear_from_level(level),
                               std::exp(-0.25 * (x * x + y * y) / (apart * apart))});
    }
  if (brightest - darkest < kLeastSpan) return {};
  const double span = 0.5 * (linear_from_level(brightest) - linear_from_level(darkest));
  for (Window::Pixel& pixel : window.pixels) pixel.value /= span;
  return window;
}

// Whether the first quadrant of the two lines is the bright one: the sign of the contrast.
double sign_of(const Window& window, const CornerGuess& guess) {
  double sum = 0.0, mean = 0.0;
  for (const auto& pixel : window.pixels)
    mean += pixel.value / static_cast<double>(window.pixels.size());
  for (const auto& pixel : window.pixels) {
    const Vec2 at(pixel.x, pixel.y);
    const auto side = [&](const Vec2& line) { return line.x() * at.y() - line.y() * at.x(); };
    sum += side(guess.across_px) * side(guess.down_px) * (pixel.value - mean);
  }
  return sum < 0.0 ? -1.0 : 1.0;
}

}  // namespace

std::optional<Vec2> fit_corner(const cv::Mat& gray, const CornerGuess& guess, double most_px) {
  const double reach = kReachShare * std::min(guess.across_px.norm(), guess.down_px.norm());
  const int half = std::clamp(static_cast<int>(reach), kLeastHalf, kMostHalf);
  const int middle_x = static_cast<int>(std::floor(guess.pixel.x()));
  const int middle_y = static_cast<int>(std::floor(guess.pixel.y()));
  const Window window = cut_window(gray, middle_x, middle_y, half);
  if (static_cast<int>(window.pixels.size()) <= 2 * kParameters) return std::nullopt;

  double mean = 0.0;
  for (const auto& pixel : window.pixels)
    mean += pixel.value / static_cast<double>(window.pixels.size());
  const Vec2 middle(middle_x + 0.5, middle_y + 0.5);
  Eigen::Matrix<double, kParameters, 1> p;
  p << guess.pixel - middle, std::atan2(guess.across_px.y(), guess.across_px.x()),
      std::atan2(guess.down_px.y(), guess.down_px.x()), 0.5, mean, sign_of(window, guess), 0.0, 0.0,
      0.0;
  using Function = ceres::TinySolverAutoDiffFunction<Window, Eigen::Dynamic, kParameters>;
  const Function function(window);
  ceres::TinySolver<Function> solver;
  solver.options.max_num_iterations = 30;
  solver.Solve(function, &p);

  const double rms =
      std::sqrt(2.0 * solver.summary.final_cost / static_cast<double>(window.pixels.size()));
  const bool good = p.allFinite() && (p.head<2>() + middle - guess.pixel).norm() <= most_px &&
                    rms <= kMostResidual * std::abs(p[kContrast]) &&
                    std::abs(std::sin(p[kAcross] - p[kDown])) >= kLeastSine;
  if (!good) return std::nullopt;
  return Vec2(p.head<2>() + middle);
}

}  // namespace rugae
