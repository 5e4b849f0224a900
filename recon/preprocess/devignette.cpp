#include "recon/preprocess/devignette.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/check.h"

namespace rugae {
namespace {

constexpr int kRounds = 4;         // of reweighting
constexpr double kLambda = 0.3;    // smoothness
constexpr double kAlpha = 0.6;     // exponent of the sparse gradient prior
constexpr int kWorkWidthPx = 320;  // gradients are taken at about this width: less noise, less time
constexpr float kDarkest = 8.0F;   // below, one 8-bit step is more than 12 % of the intensity
constexpr float kBrightest = 250.0F;  // above, the sensor may be saturated

// A radial gradient of ln I and the ring k it lies in, k <= radius < k + 1.
struct RadialGradient {
  int ring;
  float psi;
};

// psi = grad(ln I) . r / |r| by central differences, at every pixel whose four neighbours are
// usable.
void collect(const cv::Mat& gray, const cv::Mat& usable, const Vec2& center_px, int rings,
             std::vector<RadialGradient>& out) {
  cv::Mat intensity;
  gray.convertTo(intensity, CV_32F);
  cv::Mat good = (intensity >= kDarkest) & (intensity <= kBrightest);
  if (!usable.empty()) good &= usable;
  cv::Mat log_intensity;
  cv::log(cv::max(intensity, kDarkest), log_intensity);
  for (int y = 1; y + 1 < gray.rows; ++y) {
    const auto* up = log_intensity.ptr<float>(y - 1);
    const auto* mid = log_intensity.ptr<float>(y);
    const auto* down = log_intensity.ptr<float>(y + 1);
    const auto* good_up = good.ptr<unsigned char>(y - 1);
    const auto* good_mid = good.ptr<unsigned char>(y);
    const auto* good_down = good.ptr<unsigned char>(y + 1);
    for (int x = 1; x + 1 < gray.cols; ++x) {
      if (!(good_up[x] && good_down[x] && good_mid[x - 1] && good_mid[x + 1])) continue;
      const double rx = x + 0.5 - center_px.x(), ry = y + 0.5 - center_px.y();
      const double radius = std::hypot(rx, ry);
      const int ring = static_cast<int>(radius);
      if (radius < 1.0 || ring >= rings) continue;
      const double dx = 0.5 * (mid[x + 1] - mid[x - 1]), dy = 0.5 * (down[x] - up[x]);
      out.push_back({ring, static_cast<float>((dx * rx + dy * ry) / radius)});
    }
  }
}

// w = exp(-s) (1 - exp(-alpha s^(alpha - 1))), s = |residual|; its limit at s = 0 is 1.
double weight(double residual) {
  const double s = std::abs(residual);
  if (s < 1e-12) return 1.0;
  return std::exp(-s) * (1.0 - std::exp(-kAlpha * std::pow(s, kAlpha - 1.0)));
}

// Minimises  sum_k sum_{i in ring k} w_i (psi_i - (B_{k+1} - B_k))^2
//          + lambda sum_k N_k (B_{k-1} - 2 B_k + B_{k+1})^2   over B_1 .. B_n, with B_0 = 0.
Eigen::VectorXd solve(const Eigen::VectorXd& sum_w, const Eigen::VectorXd& sum_w_psi,
                      const Eigen::VectorXd& count) {
  const auto rings = sum_w.size();
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(rings + 1, rings + 1);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(rings + 1);
  for (Eigen::Index k = 0; k < rings; ++k) {
    a(k, k) += sum_w[k];
    a(k + 1, k + 1) += sum_w[k];
    a(k, k + 1) -= sum_w[k];
    a(k + 1, k) -= sum_w[k];
    b[k] -= sum_w_psi[k];
    b[k + 1] += sum_w_psi[k];
  }
  const Eigen::Vector3d second(1.0, -2.0, 1.0);
  for (Eigen::Index k = 1; k < rings; ++k) {
    const double n = std::max(count[k], 1.0);  // an empty ring is bridged smoothly
    a.block<3, 3>(k - 1, k - 1) += kLambda * n * second * second.transpose();
  }
  Eigen::VectorXd profile = Eigen::VectorXd::Zero(rings + 1);
  profile.tail(rings) = a.bottomRightCorner(rings, rings).ldlt().solve(b.tail(rings));
  return profile;
}

}  // namespace

double VignettingProfile::at(double radius_px) const {
  const double t = std::clamp(radius_px / reach_px, 0.0, 1.0) * static_cast<double>(v.size() - 1);
  const std::size_t k = std::min(static_cast<std::size_t>(t), v.size() - 2);
  const double f = t - static_cast<double>(k);
  return (1.0 - f) * v[k] + f * v[k + 1];
}

VignettingProfile estimate_vignetting(const std::vector<cv::Mat>& grays,
                                      const std::vector<cv::Mat>& usable, const Vec2& center_px,
                                      double reach_px) {
  check(!grays.empty(), "vignetting: no images");
  check(usable.empty() || usable.size() == grays.size(), "vignetting: {} masks for {} images",
        usable.size(), grays.size());
  const int step = std::max(1, grays[0].cols / kWorkWidthPx);
  const int rings = std::max(8, static_cast<int>(std::ceil(reach_px / step)));
  std::vector<RadialGradient> gradients;
  for (std::size_t i = 0; i < grays.size(); ++i) {
    cv::Mat gray = grays[i], mask = usable.empty() ? cv::Mat() : usable[i];
    const cv::Size size(gray.cols / step, gray.rows / step);
    if (step > 1) {
      // The rest of the division is cut off, so that the centre moves by the factor alone.
      const cv::Rect whole(0, 0, size.width * step, size.height * step);
      cv::resize(gray(whole), gray, size, 0, 0, cv::INTER_AREA);
      if (!mask.empty()) {
        cv::resize(mask(whole), mask, size, 0, 0, cv::INTER_AREA);
        mask = mask == 255;
      }
    }
    collect(gray, mask, center_px / step, rings, gradients);
  }

  Eigen::VectorXd count = Eigen::VectorXd::Zero(rings);
  for (const RadialGradient& g : gradients) count[g.ring] += 1.0;
  Eigen::VectorXd profile;
  for (int round = 0; round < kRounds; ++round) {
    Eigen::VectorXd sum_w = Eigen::VectorXd::Zero(rings), sum_w_psi = sum_w;
    for (const RadialGradient& g : gradients) {
      const double w = round == 0 ? 1.0 : weight(g.psi - (profile[g.ring + 1] - profile[g.ring]));
      sum_w[g.ring] += w;
      sum_w_psi[g.ring] += w * g.psi;
    }
    // A ring without gradients is held by the smoothness alone; a trace of data keeps the system
    // regular when there are no gradients at all (black images): V = 1.
    sum_w.array() += 1e-9;
    profile = solve(sum_w, sum_w_psi, count);
  }

  VignettingProfile result{center_px, static_cast<double>(rings) * step, {}};
  for (Eigen::Index k = 0; k <= rings; ++k) result.v.push_back(std::exp(profile[k]));
  return result;
}

cv::Mat vignetting_gain(const VignettingProfile& profile, int width, int height) {
  cv::Mat gain(height, width, CV_32F);
  for (int y = 0; y < height; ++y) {
    auto* row = gain.ptr<float>(y);
    for (int x = 0; x < width; ++x) {
      const double radius = (Vec2(x + 0.5, y + 0.5) - profile.center_px).norm();
      row[x] = static_cast<float>(1.0 / profile.at(radius));
    }
  }
  return gain;
}

cv::Mat apply_gain(const cv::Mat& image, const cv::Mat& gain) {
  cv::Mat factor = gain;
  if (image.channels() == 3) cv::merge(std::vector<cv::Mat>{gain, gain, gain}, factor);
  cv::Mat product;
  cv::multiply(image, factor, product, 1.0, image.depth());
  return product;
}

}  // namespace rugae
