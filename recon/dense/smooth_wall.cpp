#include "recon/dense/smooth_wall.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/random.h"

namespace rugae {
namespace {

using Matrix = Eigen::SparseMatrix<double>;

constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();
/// The wall bends with a radius of a few millimetres, seen from some tens of them: its inverse
/// depth strays from a plane's by this times the square of a cell's angle. Measured: what fills
/// gaps is then off by one sigma (median; 1.4 with half of it, 0.7 with twice).
constexpr double kBend = 12.0;
/// Depths share their errors over a window of the correlation, some five cells.
constexpr double kSharedErrors = 2.2;
constexpr double kPriorShare = 4.0;   // of its reach: sigma of each cell
constexpr double kPointSigma = 0.01;  // of a point's depth: what it strays from the cell's mean
constexpr int kLeastPixels = 4;       // of a cell's known ones
constexpr int kLeastCells = 24;       // known: fewer say nothing of a wall
constexpr double kCauchy = 2.0;       // residual, in sigmas, at which a term's weight has halved
constexpr int kRounds = 4;
/// Largest relative change of a round, anywhere: half of the 0.6 % that a gap must be known to
/// (DenseOptions::gap_sigma_share).
constexpr double kConverged = 3e-3;
constexpr int kDraws =
    4;  // averaged over 25 cells: sigma to a tenth; more cost more than they tell
constexpr double kWidestStep = 2.0;  // inverse depth changes by this factor at most in a round
/// Pixels of a cell, each way: about half a window of the correlation, which sees nothing finer.
constexpr int kCellPx = 4;
constexpr int kCoarseCellPx = 8;  // of a first wall, where a solution costs an eighth
/// Beyond 60 degrees of incidence what spans a gap is more often a curtain from a fold's edge to
/// what lies behind it than a wall.
constexpr double kMinGapCosine = 0.5;
constexpr int kReach = 2, kSide = 2 * kReach + 1;  // cells that a cell is tied to

/// One residual: linear in the inverse depths of a few cells.
struct Term {
  std::array<int, 4> cells{};
  std::array<double, 4> slopes{};
  int count = 0;
  double offset = 0.0;

  double residual(const std::vector<double>& rho) const {
    double r = -offset;
    for (int k = 0; k < count; ++k) r += slopes[k] * rho[cells[k]];
    return r;
  }
};

/// Cells to pixels, or to smaller cells; both grids begin at the same corner.
cv::Mat pixels_of(const cv::Mat& cells, int cell_px, cv::Size size) {
  cv::Mat pixels;
  cv::resize(cells, pixels, cells.size() * cell_px, 0.0, 0.0, cv::INTER_LINEAR);
  return pixels({0, 0, size.width, size.height});
}

class Wall {
 public:
  Wall(const DepthMap& map, const std::vector<SparseDepth>& points, const DepthPrior& prior,
       int cell_px)
      : cell_px_(cell_px),
        width_((map.grid.width + cell_px - 1) / cell_px),
        height_((map.grid.height + cell_px - 1) / cell_px),
        bend_(kBend * std::pow(cell_px / map.grid.fx, 2)) {
    observe(map);
    cv::Mat surface;
    cv::resize(prior.depth, surface, {width_, height_}, 0.0, 0.0, cv::INTER_AREA);
    for (int i = 0; i < cells(); ++i) {
      const double rho = 1.0 / surface.at<float>(i / width_, i % width_);
      add_anchor(priors_, i, rho, kPriorShare * prior.reach_ln);
      if (!std::isfinite(rho_[i])) rho_[i] = rho;
    }
    for (const SparseDepth& point : points) {
      const int x = static_cast<int>(point.pixel.x() / cell_px_);
      const int y = static_cast<int>(point.pixel.y() / cell_px_);
      add_anchor(anchors_, y * width_ + x, 1.0 / point.z, kPointSigma);
    }
  }

  int known() const { return known_; }

  void start_from(const cv::Mat& inverse_depth) {
    const cv::Mat start = pixels_of(inverse_depth, kCoarseCellPx / kCellPx, {width_, height_});
    for (int i = 0; i < cells(); ++i) rho_[i] = start.at<float>(i / width_, i % width_);
  }

  /// All terms count in full: far from the solution everything would look wrong. False where the
  /// equations cannot be solved.
  bool solve_plainly() { return improve(false).has_value(); }
  bool solve_robustly() {
    for (int round = 0; round < kRounds; ++round) {
      const auto change = improve(true);
      if (!change) return false;
      if (*change < kConverged) break;
    }
    return true;
  }

  /// Of incidence: the normal of the plane through rho and its slopes is
  ///   m = (f rho_x, f rho_y, rho - a f rho_x - b f rho_y), r = (a, b, 1) the ray, m . r = rho.
  cv::Mat cosine(const PinholeGrid& grid) const {
    cv::Mat cosines(height_, width_, CV_32F);
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) {
        const int left = std::max(x - 1, 0), right = std::min(x + 1, width_ - 1);
        const int up = std::max(y - 1, 0), down = std::min(y + 1, height_ - 1);
        const double px = cell_px_;
        const Vec2 slope(
            grid.fx * (rho_[y * width_ + right] - rho_[y * width_ + left]) / (px * (right - left)),
            grid.fy * (rho_[down * width_ + x] - rho_[up * width_ + x]) / (px * (down - up)));
        const Vec3 ray((px * (x + 0.5) - grid.cx) / grid.fx, (px * (y + 0.5) - grid.cy) / grid.fy,
                       1.0);
        const double rho = rho_[y * width_ + x];
        const Vec3 m(slope.x(), slope.y(), rho - ray.head<2>().dot(slope));
        cosines.at<float>(y, x) = static_cast<float>(rho / (m.norm() * ray.norm()));
      }
    return cosines;
  }

  cv::Mat inverse_depth() const {
    cv::Mat rho(height_, width_, CV_32F);
    for (int i = 0; i < cells(); ++i) rho.at<float>(i / width_, i % width_) = rho_[i];
    return rho;
  }

  /// Of rho, relative, the last factorisation being H = P' L D L' P: with z of unit variance
  /// P' L'^-1 D^-1/2 z has the variance of H^-1.
  cv::Mat variance(std::uint32_t number) const {
    cv::Mat sum(height_, width_, CV_32F, cv::Scalar(0.0));
    const Eigen::VectorXd deviations = cholesky_.vectorD().cwiseSqrt().cwiseInverse();
    Eigen::VectorXd draw(cells());
    for (int d = 0; d < kDraws; ++d) {
      for (int i = 0; i < cells(); ++i) {
        const std::uint64_t bit = static_cast<std::uint64_t>(d) * cells() + i;
        const auto words = random_words(0, Purpose::wall_draws, number, bit / 128);
        const bool up = words[bit / 32 % 4] >> (bit % 32) & 1;
        draw[i] = up ? deviations[i] : -deviations[i];
      }
      const Eigen::VectorXd x = cholesky_.permutationPinv() * cholesky_.matrixU().solve(draw);
      for (int i = 0; i < cells(); ++i)
        sum.at<float>(i / width_, i % width_) +=
            static_cast<float>(x[i] * x[i] / (rho_[i] * rho_[i] * kDraws));
    }
    // A few draws say little of one cell, more of it and its neighbours.
    cv::Mat smooth;
    cv::blur(sum, smooth, {5, 5}, {-1, -1}, cv::BORDER_REPLICATE);
    return smooth;
  }

 private:
  int cells() const { return width_ * height_; }

  static void add_anchor(std::vector<Term>& terms, int cell, double rho, double sigma_share) {
    const double weight = 1.0 / (rho * sigma_share);
    terms.push_back({{cell}, {weight}, 1, weight * rho});
  }

  void observe(const DepthMap& map) {
    rho_.assign(static_cast<std::size_t>(cells()), kNotKnown);
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) {
        double sum = 0.0, sigmas = 0.0;
        int count = 0;
        for (int v = cell_px_ * y; v < std::min(cell_px_ * (y + 1), map.grid.height); ++v)
          for (int u = cell_px_ * x; u < std::min(cell_px_ * (x + 1), map.grid.width); ++u) {
            const double z = map.depth.at<float>(v, u);
            if (!(z > 0.0)) continue;
            sum += 1.0 / z;
            sigmas += map.sigma.at<float>(v, u) / z;
            ++count;
          }
        if (count < kLeastPixels) continue;
        const int i = y * width_ + x;
        rho_[i] = sum / count;
        add_anchor(anchors_, i, rho_[i], kSharedErrors * sigmas / count);
        ++known_;
      }
  }

  /// Second differences, over the inverse depth that is there now.
  template <typename Use>
  void for_bends(Use use) const {
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) {
        const int i = y * width_ + x;
        const double w = 1.0 / (bend_ * rho_[i]), c = std::sqrt(2.0) * w;
        if (x > 0 && x + 1 < width_) use(Term{{i - 1, i, i + 1}, {w, -2.0 * w, w}, 3});
        if (y > 0 && y + 1 < height_) use(Term{{i - width_, i, i + width_}, {w, -2.0 * w, w}, 3});
        if (x + 1 < width_ && y + 1 < height_)
          use(Term{{i, i + 1, i + width_, i + width_ + 1}, {c, -c, -c, c}, 4});
      }
  }

  /// One step of Gauss and Newton: the largest relative change, or nothing.
  std::optional<double> improve(bool robustly) {
    assemble(robustly);
    if (cholesky_.rows() == 0) cholesky_.analyzePattern(hessian_);
    cholesky_.factorize(hessian_);
    if (cholesky_.info() != Eigen::Success) return std::nullopt;
    const Eigen::VectorXd step = cholesky_.solve(-gradient_);
    double largest = 0.0;
    for (int i = 0; i < cells(); ++i) {
      const double next =
          std::clamp(rho_[i] + step[i], rho_[i] / kWidestStep, rho_[i] * kWidestStep);
      largest = std::max(largest, std::abs(next / rho_[i] - 1.0));
      rho_[i] = next;
    }
    return std::isfinite(largest) ? std::optional(largest) : std::nullopt;
  }

  void assemble(bool robustly) {
    std::vector<std::array<double, kSide * kSide>> stencils(rho_.size());
    for (auto& stencil : stencils) stencil.fill(0.0);
    gradient_ = Eigen::VectorXd::Zero(cells());
    const auto add = [&](const Term& term, bool robust) {
      const double r = term.residual(rho_);
      const double weight = robust ? 1.0 / (1.0 + r * r / (kCauchy * kCauchy)) : 1.0;
      for (int k = 0; k < term.count; ++k) {
        const int cell = term.cells[k];
        gradient_[cell] += weight * r * term.slopes[k];
        for (int j = 0; j < term.count; ++j) {
          const int dy = term.cells[j] / width_ - cell / width_;
          const int dx = term.cells[j] % width_ - cell % width_;
          stencils[cell][(dy + kReach) * kSide + dx + kReach] +=
              weight * term.slopes[k] * term.slopes[j];
        }
      }
    };
    for (const Term& term : priors_) add(term, false);
    for (const Term& term : anchors_) add(term, robustly);
    for_bends([&](const Term& term) { add(term, robustly); });

    hessian_.resize(cells(), cells());
    hessian_.reserve(Eigen::VectorXi::Constant(cells(), kSide * kSide));
    for (int i = 0; i < cells(); ++i)
      for (int s = kSide * kSide / 2; s < kSide * kSide; ++s) {  // the lower half
        const int x = i % width_ + s % kSide - kReach, y = i / width_ + s / kSide - kReach;
        if (x < 0 || x >= width_ || y >= height_ ||
            std::abs(s % kSide - kReach) + std::abs(s / kSide - kReach) > kReach)
          continue;
        hessian_.insert(y * width_ + x, i) = stencils[i][s];
      }
    hessian_.makeCompressed();
  }

  int cell_px_, width_, height_, known_ = 0;
  double bend_ = 0.0;
  std::vector<double> rho_;
  std::vector<Term> anchors_, priors_;
  Matrix hessian_;
  Eigen::VectorXd gradient_;
  Eigen::SimplicialLDLT<Matrix, Eigen::Lower> cholesky_;
};

}  // namespace

std::optional<SmoothWall> smooth_wall(const DepthMap& map, const std::vector<SparseDepth>& points,
                                      const DepthPrior& prior, std::uint32_t number) {
  if (prior.depth.empty()) return std::nullopt;
  Wall coarse(map, points, prior, kCoarseCellPx), wall(map, points, prior, kCellPx);
  if (wall.known() < kLeastCells || !coarse.solve_plainly()) return std::nullopt;
  wall.start_from(coarse.inverse_depth());
  if (!wall.solve_robustly()) return std::nullopt;
  const cv::Size size = map.depth.size();
  SmoothWall smooth;
  smooth.depth = 1.0 / pixels_of(wall.inverse_depth(), kCellPx, size);
  cv::sqrt(pixels_of(wall.variance(number), kCellPx, size), smooth.sigma_share);
  smooth.cosine = pixels_of(wall.cosine(map.grid), kCellPx, size);
  return smooth;
}

cv::Mat fill_from(const SmoothWall& wall, double sigma_share, DepthMap& map) {
  const cv::Mat believed =
      (wall.sigma_share <= sigma_share) & (wall.cosine >= kMinGapCosine) & ~(map.depth > 0.0f);
  wall.depth.copyTo(map.depth, believed);
  cv::Mat(wall.depth.mul(wall.sigma_share)).copyTo(map.sigma, believed);
  return believed;
}

}  // namespace rugae
