#include "recon/dense/light_scale.h"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace rugae {
namespace {

constexpr int kBlocks = 16;        // of the jackknife
constexpr int kRounds = 30;        // of weights and q in turn, at most
constexpr double kSettled = 1e-5;  // share of q that a round moves it by
/// Of incidence: ln cos is so steep beyond that a few tilts drive the rounds apart.
constexpr double kLeastCosine = 0.2;
constexpr double kSigmaOfMad = 1.4826;  // of normal errors
constexpr double kWidthSpreads = 2.0;   // of the robust weights
constexpr double kLeastSpread = 1e-3;   // less is rounding of 8 bits
constexpr double kFirstSpread = 0.03;   // of ln light, before it is known
/// For a slope the light is moved by this share of the wall's distance.
constexpr double kStepShare = 1e-4;
constexpr std::size_t kFewest = 500;  // sights that say anything
constexpr int kShared = 6;            // columns besides q's: powers of r^2, off centre, wet layer

/// What the answer is tried under.
struct Belief {
  double normal_sigma_factor = 1.0;
  bool uneven = false;  // the picture's light may have a slope
};

/// Normal equations in the columns gains, fall-off, q.
struct Sums {
  Eigen::MatrixXd h;
  Eigen::VectorXd g;
};

using Shared = Eigen::Matrix<double, kShared + 1, 1>;  // the columns that every sight has
/// ln albedo and the two tilts of the normal, of one track.
using Own = Vec3;

/// The least squares as far as q is known: linearised, weighed, its equations summed.
class Fit {
  struct Track {
    std::size_t begin, end;  // of its sights
    double normal_sigma_rad;
    int block;  // of the jackknife: as many tracks in each, in the order of their
                // first key frames
  };

 public:
  Fit(const std::vector<LightSight>& sights, const std::vector<Emitter>& lights,
      const Belief& belief)
      : sights_(sights),
        lights_(lights),
        uneven_(belief.uneven),
        shared_(sights.size()),
        own_(sights.size()),
        left_(sights.size(), 0.0),
        weight_(sights.size(), 1.0),
        track_of_(sights.size(), 0) {
    for (const LightSight& sight : sights) gains_ = std::max(gains_, sight.keyframe + 1);
    for (std::size_t begin = 0, i = 1; i <= sights.size(); ++i) {
      if (i < sights.size() && sights[i].track == sights[begin].track) continue;
      int first = sights[begin].keyframe;
      for (std::size_t j = begin; j < i; ++j) first = std::min(first, sights[j].keyframe);
      if (i - begin >= 2) {
        std::fill_n(track_of_.begin() + static_cast<std::ptrdiff_t>(begin), i - begin,
                    tracks_.size());
        tracks_.push_back({begin, i,
                           belief.normal_sigma_factor *
                               std::hypot(kLeastNormalSigmaRad, sights[begin].normal_sigma_rad),
                           first});
      }
      begin = i;
    }
    tilt_.assign(std::max<std::size_t>(tracks_.size(), 1), Vec2::Zero());
    std::vector<Track*> order;
    for (Track& track : tracks_) order.push_back(&track);
    std::ranges::stable_sort(order, {}, &Track::block);
    for (std::size_t t = 0; t < order.size(); ++t)
      order[t]->block = static_cast<int>(kBlocks * t / order.size());
  }

  int gains() const { return gains_; }
  double spread() const { return spread_; }

  /// q's column counts in `unit_q`, so that the equations are the same in every map unit.
  void linearise(double q, double unit_q) {
    const double step_q = kStepShare * unit_q;
    tbb::parallel_for(std::size_t{0}, sights_.size(), [&](std::size_t i) {
      LightSight sight = sights_[i];
      const Vec2& tilt = tilt_[track_of_[i]];
      sight.normal_cam =
          (sight.normal_cam + tilt.x() * sight.tangent_x_cam + tilt.y() * sight.tangent_y_cam)
              .normalized();
      const auto at = received_light(sight, lights_, q),
                 ahead = received_light(sight, lights_, q + step_q),
                 behind = received_light(sight, lights_, q - step_q);
      // The way in, from where most of the light comes.
      const double in = at ? sight.normal_cam.dot(at->per_normal.normalized()) : 0.0;
      const double off_axis_cosine = sight.p_cam.normalized().z();
      if (!(in >= kLeastCosine) || !ahead || !behind || !(off_axis_cosine > 0.0)) {
        weight_[i] = 0.0;  // turned away from the light, as far as is known, or behind the lens
        return;
      }
      if (weight_[i] == 0.0) weight_[i] = 1.0;
      const double r2 = sight.off_axis.squaredNorm();
      const double out = -sight.normal_cam.dot(sight.p_cam.normalized());
      shared_[i] << r2, r2 * r2, r2 * r2 * r2, uneven_ ? sight.off_axis : Vec2(Vec2::Zero()),
          std::pow(1.0 - in, 5) + std::pow(1.0 - out, 5),
          (ahead->ln - behind->ln) / (2.0 * kStepShare);
      own_[i] = {1.0, at->per_normal.dot(sight.tangent_x_cam),
                 at->per_normal.dot(sight.tangent_y_cam)};
      left_[i] = sight.ln_level - at->ln - 4.0 * std::log(off_axis_cosine);
    });
  }

  /// A track's own unknowns are eliminated.
  std::vector<Sums> sums() const {
    const int n = gains_ + kShared + 1;
    std::vector<Sums> blocks(kBlocks, {Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)});
    tbb::parallel_for(0, kBlocks, [&](int b) {
      for (const Track& track : tracks_)
        if (track.block == b) add(track, blocks[static_cast<std::size_t>(b)]);
    });
    return blocks;
  }

  /// What is left after all unknowns gives the weights and the spread.
  void judge(const Eigen::VectorXd& x) {
    std::vector<double> off(sights_.size(), 0.0), sizes;
    for (const Track& track : tracks_) {
      Own right = Own::Zero();
      for (std::size_t i = track.begin; i < track.end; ++i) {
        off[i] = left_[i] - x[sights_[i].keyframe] - x.tail<kShared + 1>().dot(shared_[i]);
        right += weight_[i] * off[i] * own_[i];
      }
      right.tail<2>() -= tilt_precision(track) * tilt_[track_of_[track.begin]];
      const Own found = own_inverse(track) * right;
      for (std::size_t i = track.begin; i < track.end; ++i) {
        off[i] -= found.dot(own_[i]);
        if (weight_[i] > 0.0) sizes.push_back(std::abs(off[i]));
      }
      tilt_[track_of_[track.begin]] += found.tail<2>();
    }
    if (sizes.empty()) return;
    const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
    std::nth_element(sizes.begin(), middle, sizes.end());
    spread_ = std::max(kLeastSpread, kSigmaOfMad * *middle);
    for (std::size_t i = 0; i < weight_.size(); ++i) {
      const double share = off[i] / (kWidthSpreads * spread_);
      if (weight_[i] > 0.0) weight_[i] = 1.0 / (1.0 + share * share);  // Cauchy's
    }
  }

 private:
  // Of least squares whose residuals have the spread, and tilts their own.
  double tilt_precision(const Track& track) const {
    return spread_ * spread_ / (track.normal_sigma_rad * track.normal_sigma_rad);
  }
  Mat3 own_inverse(const Track& track) const {
    Mat3 normal = Vec3(0.0, tilt_precision(track), tilt_precision(track)).asDiagonal();
    for (std::size_t i = track.begin; i < track.end; ++i)
      normal += weight_[i] * own_[i] * own_[i].transpose();
    if (!(normal(0, 0) > 0.0)) return Mat3::Zero();  // no sight of it is lit
    return normal.inverse();
  }

  void add(const Track& track, Sums& s) const {
    const Mat3 inverse = own_inverse(track);
    Eigen::Matrix<double, kShared + 1, 3> shared_own =
        Eigen::Matrix<double, kShared + 1, 3>::Zero();
    Own right = Own::Zero();
    for (std::size_t i = track.begin; i < track.end; ++i) {
      shared_own += weight_[i] * shared_[i] * own_[i].transpose();
      right += weight_[i] * left_[i] * own_[i];
    }
    right.tail<2>() -= tilt_precision(track) * tilt_[track_of_[track.begin]];
    auto corner = s.h.bottomRightCorner<kShared + 1, kShared + 1>();
    for (std::size_t a = track.begin; a < track.end; ++a) {
      const double w = weight_[a];
      const int k = sights_[a].keyframe;
      const Own at = w * (inverse * own_[a]);
      s.h(k, k) += w;
      for (std::size_t c = track.begin; c < track.end; ++c)
        if (sights_[c].keyframe >= k) s.h(k, sights_[c].keyframe) -= weight_[c] * at.dot(own_[c]);
      s.h.block<1, kShared + 1>(k, gains_) += (w * shared_[a] - shared_own * at).transpose();
      s.g[k] += w * left_[a] - at.dot(right);
      corner += w * shared_[a] * shared_[a].transpose();
      s.g.tail<kShared + 1>() += w * left_[a] * shared_[a];
    }
    corner -= shared_own * inverse * shared_own.transpose();
    s.g.tail<kShared + 1>() -= shared_own * (inverse * right);
  }

  const std::vector<LightSight>& sights_;
  const std::vector<Emitter>& lights_;
  bool uneven_ = false;
  int gains_ = 0;
  std::vector<Track> tracks_;
  std::vector<Shared> shared_;
  std::vector<Own> own_;
  std::vector<double> left_, weight_;  // ln level less what is known; robust
  std::vector<std::size_t> track_of_;  // of each sight
  std::vector<Vec2> tilt_;             // of each track's normal, rad
  double spread_ = kFirstSpread;
};

// Gains are known up to a common factor: their mean is 0, and so is all of which nothing is known.
std::optional<Eigen::VectorXd> solve(const Eigen::MatrixXd& h, const Eigen::VectorXd& g,
                                     int gains) {
  Eigen::MatrixXd whole = h.selfadjointView<Eigen::Upper>();
  auto of_gains = whole.topLeftCorner(gains, gains);
  const double mean = of_gains.diagonal().mean();
  for (Eigen::Index k = 0; k < whole.rows(); ++k)
    if (!(whole(k, k) > 0.0)) whole(k, k) = mean;
  of_gains.array() += mean / gains;
  const Eigen::LDLT<Eigen::MatrixXd> solver(whole);
  Eigen::VectorXd x = solver.solve(g);
  return x.allFinite() ? std::optional(std::move(x)) : std::nullopt;
}

struct LightFit {
  double q = 0.0, sigma_q = 0.0, spread_ln = 0.0;
};

// Delete-a-group jackknife (Miller 1974, doi:10.1093/biomet/61.1.1) about the settled fit: how q
// moves when a block's equations are left out, in the unit of its column.
std::optional<double> jackknife(const std::vector<Sums>& blocks, const Sums& all, int gains) {
  std::vector<double> without;
  for (const Sums& block : blocks) {
    if (!(block.h.diagonal().sum() > 0.0)) continue;
    const auto x = solve(all.h - block.h, all.g - block.g, gains);
    if (!x) return std::nullopt;
    without.push_back((*x)[x->size() - 1]);
  }
  const double n = static_cast<double>(without.size());
  if (n < 2.0) return std::nullopt;
  double mean = 0.0, square = 0.0;
  for (const double shift : without) mean += shift / n;
  for (const double shift : without) square += (shift - mean) * (shift - mean);
  return std::sqrt((n - 1.0) / n * square);
}

std::optional<LightFit> fit_light(const std::vector<LightSight>& sights,
                                  const std::vector<Emitter>& lights, double unit_q,
                                  const Belief& belief) {
  Fit fit(sights, lights, belief);
  LightFit found;
  std::vector<Sums> blocks;
  Sums all;
  for (int round = 0; round < kRounds; ++round) {
    fit.linearise(found.q, unit_q);
    blocks = fit.sums();
    all = blocks[0];
    for (std::size_t b = 1; b < blocks.size(); ++b) {
      all.h += blocks[b].h;
      all.g += blocks[b].g;
    }
    const auto x = solve(all.h, all.g, fit.gains());
    if (!x) return std::nullopt;
    const double moved = unit_q * (*x)[x->size() - 1];
    fit.judge(*x);
    found.q += moved;
    if (std::abs(moved) <= kSettled * std::abs(found.q)) break;
  }
  const auto sigma_q = jackknife(blocks, all, fit.gains());
  if (!sigma_q || !std::isfinite(found.q)) return std::nullopt;
  found.sigma_q = unit_q * *sigma_q;
  found.spread_ln = fit.spread();
  return found;
}

}  // namespace

std::optional<ReceivedLight> received_light(const LightSight& sight,
                                            const std::vector<Emitter>& lights, double q) {
  double sum = 0.0;
  Vec3 per_normal = Vec3::Zero();
  for (const Emitter& light : lights) {
    const Vec3 from_light = sight.p_cam - q * light.offset_mm;
    const double distance = from_light.norm();
    const Vec3 w = from_light / distance;
    const double cosine = -sight.normal_cam.dot(w);
    if (!(cosine > 0.0)) continue;
    const double strength =
        light.intensity * std::exp(-light.lobe * (1.0 - light.axis.dot(w))) / (distance * distance);
    sum += strength * cosine;
    per_normal -= strength * w;
  }
  if (!(sum > 0.0)) return std::nullopt;
  return ReceivedLight{std::log(sum), per_normal / sum};
}

std::optional<LightScale> scale_from_light(const std::vector<LightSight>& sights,
                                           const std::vector<Emitter>& lights) {
  double beside_mm = 0.0;
  for (const Emitter& light : lights) beside_mm = std::max(beside_mm, light.offset_mm.norm());
  if (!(beside_mm > 0.0) || sights.size() < kFewest) return std::nullopt;
  std::vector<double> depths;
  for (const LightSight& sight : sights) depths.push_back(sight.p_cam.z());
  const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
  std::nth_element(depths.begin(), middle, depths.end());
  const double unit_q = *middle / beside_mm;

  const auto fit = [&](const Belief& belief) { return fit_light(sights, lights, unit_q, belief); };
  const auto found = fit({}), stiffer = fit({.normal_sigma_factor = 1.0 / kNormalSigmaFactor}),
             looser = fit({.normal_sigma_factor = kNormalSigmaFactor}),
             uneven = fit({.uneven = true});
  if (!found || !stiffer || !looser || !uneven || !(found->q > 0.0)) return std::nullopt;
  const auto [least, most] = std::minmax({found->q, stiffer->q, looser->q});
  const double by_normals = 0.5 * (most - least), by_slope = 0.5 * (uneven->q - found->q);
  LightScale scale;
  scale.mm_per_unit = 1.0 / found->q;
  scale.sigma_share = std::hypot(found->sigma_q, by_normals, by_slope) / found->q;
  scale.sights = sights.size();
  scale.spread_ln = found->spread_ln;
  return scale.sigma_share <= kMostUncertain ? std::optional(scale) : std::nullopt;
}

}  // namespace rugae
