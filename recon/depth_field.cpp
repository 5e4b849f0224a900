#include "recon/depth_field.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace rugae {
namespace {

constexpr std::size_t kMinSamples = 12;
constexpr int kFold = 5;  // every fifth sample is left out to choose the penalty
constexpr int kReweightings = 4;
constexpr double kMadToSigma = 1.4826;  // of a normal distribution
constexpr double kKeptSigmas = 3.0;
/// Cauchy's weight 1 / (1 + (r / (c sigma))^2): 95 % efficient for normal errors.
constexpr double kCauchy = 2.385;
/// Strength of the thin-plate penalty against the mean weight of samples on a control point.
constexpr std::array<double, 4> kPenalties = {1e-2, 1e-1, 1.0, 10.0};
constexpr double kFirstPenalty = 1e-1;
/// Keeps control points that no sample reaches from making the system singular.
constexpr double kRidge = 1e-9;
/// The scale is expected near 0 with this standard deviation: without contrast in the ingredient
/// the samples do not determine it.
constexpr double kScalePrior = 1.0;

/// The four uniform cubic B-spline weights at fraction t of a cell.
std::array<double, 4> cubic_weights(double t) {
  const double u = 1.0 - t;
  return {u * u * u / 6.0, (3 * t * t * t - 6 * t * t + 4) / 6.0,
          (-3 * t * t * t + 3 * t * t + 3 * t + 1) / 6.0, t * t * t / 6.0};
}

struct Cell {
  int column = 0, row = 0;  // of the first of the four control points each way
  std::array<double, 4> across{}, down{};
};

Cell cell_at(const DepthField& field, const Vec2& pixel) {
  const double u = std::max(pixel.x() / field.spacing_px, 0.0);
  const double v = std::max(pixel.y() / field.spacing_px, 0.0);
  Cell cell;
  cell.column = std::min(static_cast<int>(u), field.columns - 4);
  cell.row = std::min(static_cast<int>(v), field.rows - 4);
  cell.across = cubic_weights(std::min(u - cell.column, 1.0));
  cell.down = cubic_weights(std::min(v - cell.row, 1.0));
  return cell;
}

/// The normal equations of the spline: each control point meets those within three rows and columns
/// of it. Half of the symmetric matrix is kept: 4 entries of its own row, 7 of each row below.
class NormalEquations {
 public:
  NormalEquations(int columns, int rows) : columns_(columns), rows_(rows) {}

  /// Minimises sum w (value - spline - scale * ingredient)^2 + penalty; false when not determined.
  bool solve(const std::vector<FieldSample>& samples, const std::vector<double>& weights,
             double penalty, double min_sigma, DepthField& field) {
    stencil_.assign(static_cast<std::size_t>(columns_) * rows_, {});
    const int controls = columns_ * rows_;
    Eigen::MatrixXd right = Eigen::MatrixXd::Zero(controls, 2);  // of values, of the ingredient
    double total = 0.0, ingredient_square = 0.0, ingredient_value = 0.0;
    for (std::size_t s = 0; s < samples.size(); ++s) {
      if (!(weights[s] > 0.0)) continue;
      add_sample(cell_at(field, samples[s].pixel), samples[s], weights[s], right);
      total += weights[s];
      ingredient_square += weights[s] * samples[s].ingredient * samples[s].ingredient;
      ingredient_value += weights[s] * samples[s].ingredient * samples[s].value;
    }
    if (!(total > 0.0)) return false;
    const double mean_weight = total / controls;
    add_penalty(penalty * mean_weight);
    for (auto& entries : stencil_) entries[0] += kRidge * mean_weight;

    const Eigen::SparseMatrix<double> normal = matrix();
    if (!analysed_) factor_.analyzePattern(normal);
    analysed_ = true;
    factor_.factorize(normal);
    if (factor_.info() != Eigen::Success) return false;
    // The scale is eliminated: A c + b s = v, b'c + d s = e.
    const Eigen::MatrixXd solution = factor_.solve(right);
    const double sigma = std::max(field.sigma, min_sigma);  // of the round before
    const double left = ingredient_square + sigma * sigma / (kScalePrior * kScalePrior) -
                        right.col(1).dot(solution.col(1));
    field.scale = (ingredient_value - right.col(1).dot(solution.col(0))) / left;
    field.control = solution.col(0) - field.scale * solution.col(1);
    return field.control.allFinite() && std::isfinite(field.scale);
  }

 private:
  static constexpr int kEntries = 25;
  /// Place of the entry (down, across) in the half stencil; down > 0, or down = 0 and across >= 0.
  static int entry(int down, int across) { return down == 0 ? across : 7 * down + across; }

  void add_sample(const Cell& cell, const FieldSample& sample, double weight,
                  Eigen::MatrixXd& right) {
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 4; ++i) {
        const int index = (cell.row + j) * columns_ + cell.column + i;
        const double own = weight * cell.down[j] * cell.across[i];
        right(index, 0) += own * sample.value;
        right(index, 1) += own * sample.ingredient;
        std::array<double, kEntries>& entries = stencil_[index];
        for (int below = j; below < 4; ++below)
          for (int other = below == j ? i : 0; other < 4; ++other)
            entries[entry(below - j, other - i)] += own * cell.down[below] * cell.across[other];
      }
  }

  /// Squared second differences of the control points, the mixed one twice: thin plate.
  void add_penalty(double strength) {
    struct Tap {
      int row, column;
      double factor;
    };
    const auto add = [&](int r, int c, std::initializer_list<Tap> taps, double weight) {
      for (const Tap& a : taps)
        for (const Tap& b : taps)
          if (b.row > a.row || (b.row == a.row && b.column >= a.column))
            stencil_[(r + a.row) * columns_ + c + a.column][entry(
                b.row - a.row, b.column - a.column)] += strength * weight * a.factor * b.factor;
    };
    for (int r = 0; r < rows_; ++r)
      for (int c = 0; c < columns_; ++c) {
        if (c + 2 < columns_) add(r, c, {{0, 0, 1.0}, {0, 1, -2.0}, {0, 2, 1.0}}, 1.0);
        if (r + 2 < rows_) add(r, c, {{0, 0, 1.0}, {1, 0, -2.0}, {2, 0, 1.0}}, 1.0);
        if (c + 1 < columns_ && r + 1 < rows_)
          add(r, c, {{0, 0, 1.0}, {0, 1, -1.0}, {1, 0, -1.0}, {1, 1, 1.0}}, 2.0);
      }
  }

  /// The lower half, column by column, always with the same pattern.
  Eigen::SparseMatrix<double> matrix() const {
    const int controls = columns_ * rows_;
    Eigen::SparseMatrix<double> lower(controls, controls);
    lower.reserve(Eigen::VectorXi::Constant(controls, kEntries));
    for (int r = 0; r < rows_; ++r)
      for (int c = 0; c < columns_; ++c)
        for (int down = 0; down < 4 && r + down < rows_; ++down)
          for (int across = down == 0 ? 0 : -3; across <= 3; ++across)
            if (c + across >= 0 && c + across < columns_)
              lower.insert((r + down) * columns_ + c + across, r * columns_ + c) =
                  stencil_[r * columns_ + c][entry(down, across)];
    lower.makeCompressed();
    return lower;
  }

  int columns_, rows_;
  bool analysed_ = false;
  std::vector<std::array<double, kEntries>> stencil_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> factor_;
};

void find_residuals(const std::vector<FieldSample>& samples, DepthField& field) {
  field.residuals.resize(samples.size());
  for (std::size_t s = 0; s < samples.size(); ++s)
    field.residuals[s] =
        samples[s].value - field.spline(samples[s].pixel) - field.scale * samples[s].ingredient;
}

double median_magnitude(std::vector<double> values) {
  for (double& value : values) value = std::abs(value);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Iteratively reweighted least squares; the last weights are left in `weights`.
bool solve_robustly(const std::vector<FieldSample>& samples, double penalty, double min_sigma,
                    NormalEquations& equations, DepthField& field, std::vector<double>& weights) {
  for (int round = 0; round < kReweightings; ++round) {
    if (!equations.solve(samples, weights, penalty, min_sigma, field)) return false;
    find_residuals(samples, field);
    field.sigma = std::max(kMadToSigma * median_magnitude(field.residuals), min_sigma);
    for (std::size_t s = 0; s < samples.size(); ++s) {
      const double r = field.residuals[s] / (kCauchy * field.sigma);
      weights[s] = samples[s].weight / (1.0 + r * r);
    }
  }
  return true;
}

/// Smallest eigenvalue over the largest of the samples' scatter: zero on a line.
bool on_a_line(const std::vector<FieldSample>& samples) {
  Vec2 mean = Vec2::Zero();
  for (const FieldSample& sample : samples) mean += sample.pixel;
  mean /= static_cast<double>(samples.size());
  Mat2 scatter = Mat2::Zero();
  for (const FieldSample& sample : samples)
    scatter += (sample.pixel - mean) * (sample.pixel - mean).transpose();
  const Vec2 values = Eigen::SelfAdjointEigenSolver<Mat2>(scatter).eigenvalues();
  constexpr double kFlat = 1e-3;
  return !(values[0] > kFlat * values[1]);
}

}  // namespace

double DepthField::spline(const Vec2& pixel) const {
  const Cell cell = cell_at(*this, pixel);
  double value = 0.0;
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 4; ++i)
      value += cell.down[j] * cell.across[i] * control[(cell.row + j) * columns + cell.column + i];
  return value;
}

std::optional<DepthField> fit_depth_field(const std::vector<FieldSample>& samples, cv::Size size,
                                          double spacing_px, double min_sigma) {
  if (samples.size() < kMinSamples || on_a_line(samples)) return std::nullopt;
  DepthField field;
  field.spacing_px = spacing_px;
  field.columns = static_cast<int>(std::ceil(size.width / spacing_px)) + 3;
  field.rows = static_cast<int>(std::ceil(size.height / spacing_px)) + 3;

  NormalEquations equations(field.columns, field.rows);
  std::vector<double> weights;
  for (const FieldSample& sample : samples) weights.push_back(sample.weight);
  if (!solve_robustly(samples, kFirstPenalty, min_sigma, equations, field, weights))
    return std::nullopt;

  // Every fifth sample, by their order, is left out; wrong ones were unmasked above and the mean
  // over the rest is weighted accordingly.
  double best_penalty = kFirstPenalty, best_error = std::numeric_limits<double>::infinity();
  for (const double penalty : kPenalties) {
    DepthField trial = field;
    std::vector<double> training = weights;
    for (std::size_t s = 0; s < samples.size(); s += kFold) training[s] = 0.0;
    if (!equations.solve(samples, training, penalty, min_sigma, trial)) continue;
    find_residuals(samples, trial);
    double error = 0.0, total = 0.0;
    for (std::size_t s = 0; s < samples.size(); s += kFold) {
      error += weights[s] * std::abs(trial.residuals[s]);
      total += weights[s];
    }
    if (total > 0.0 && error / total < best_error)
      best_error = error / total, best_penalty = penalty;
  }
  if (!solve_robustly(samples, best_penalty, min_sigma, equations, field, weights))
    return std::nullopt;
  field.held_out = best_error;
  for (const double residual : field.residuals)
    field.kept.push_back(std::abs(residual) <= kKeptSigmas * field.sigma);
  return field;
}

}  // namespace rugae
