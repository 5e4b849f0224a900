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
constexpr int kReweightings = 5;
constexpr double kMadToSigma = 1.4826;  // of a normal distribution
constexpr double kKeptSigmas = 3.0;
/// Cauchy's weight 1 / (1 + (r / (c sigma))^2): 95 % efficient for normal errors.
constexpr double kCauchy = 2.385;
/// Strength of the thin-plate penalty against the mean weight of samples on a control point.
constexpr std::array<double, 5> kPenalties = {1e-3, 1e-2, 1e-1, 1.0, 10.0};
constexpr double kFirstPenalty = 1e-1;
/// Keeps control points that no sample reaches from making the system singular.
constexpr double kRidge = 1e-9;
/// The scale is held to zero with the strength of this share of the samples' own say: without any
/// contrast in the ingredient it is not determined.
constexpr double kScaleRidge = 1e-6;

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

using Triplets = std::vector<Eigen::Triplet<double>>;

/// Squared second differences of the control points, the mixed one twice: thin plate.
void add_penalty(const DepthField& field, double strength, Triplets& lower) {
  const auto index = [&](int row, int column) { return row * field.columns + column; };
  const auto add = [&](std::initializer_list<std::pair<int, double>> stencil, double weight) {
    for (const auto& [i, a] : stencil)
      for (const auto& [j, b] : stencil)
        if (i >= j) lower.emplace_back(i, j, strength * weight * a * b);
  };
  for (int r = 0; r < field.rows; ++r)
    for (int c = 0; c < field.columns; ++c) {
      if (c + 2 < field.columns)
        add({{index(r, c), 1.0}, {index(r, c + 1), -2.0}, {index(r, c + 2), 1.0}}, 1.0);
      if (r + 2 < field.rows)
        add({{index(r, c), 1.0}, {index(r + 1, c), -2.0}, {index(r + 2, c), 1.0}}, 1.0);
      if (c + 1 < field.columns && r + 1 < field.rows)
        add({{index(r, c), 1.0},
             {index(r, c + 1), -1.0},
             {index(r + 1, c), -1.0},
             {index(r + 1, c + 1), 1.0}},
            2.0);
    }
}

/// Minimises sum w (value - spline - scale * ingredient)^2 + penalty; false when not determined.
bool solve(const std::vector<FieldSample>& samples, const std::vector<double>& weights,
           double penalty, DepthField& field) {
  const int controls = field.columns * field.rows, unknowns = controls + 1;
  Triplets lower;
  Eigen::VectorXd right = Eigen::VectorXd::Zero(unknowns);
  double total = 0.0, ingredient_square = 0.0;
  for (std::size_t s = 0; s < samples.size(); ++s) {
    const double w = weights[s];
    if (!(w > 0.0)) continue;
    const Cell cell = cell_at(field, samples[s].pixel);
    std::array<std::pair<int, double>, 17> row;
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 4; ++i)
        row[4 * j + i] = {(cell.row + j) * field.columns + cell.column + i,
                          cell.down[j] * cell.across[i]};
    row[16] = {controls, samples[s].ingredient};
    for (std::size_t a = 0; a < row.size(); ++a) {
      right[row[a].first] += w * row[a].second * samples[s].value;
      for (std::size_t b = 0; b <= a; ++b)
        lower.emplace_back(row[a].first, row[b].first, w * row[a].second * row[b].second);
    }
    total += w;
    ingredient_square += w * samples[s].ingredient * samples[s].ingredient;
  }
  if (!(total > 0.0)) return false;
  const double mean_weight = total / controls;
  add_penalty(field, penalty * mean_weight, lower);
  for (int i = 0; i < controls; ++i) lower.emplace_back(i, i, kRidge * mean_weight);
  lower.emplace_back(controls, controls,
                     kScaleRidge * ingredient_square + std::numeric_limits<double>::min());
  Eigen::SparseMatrix<double> normal(unknowns, unknowns);
  normal.setFromTriplets(lower.begin(), lower.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> factor(normal);
  if (factor.info() != Eigen::Success) return false;
  const Eigen::VectorXd solution = factor.solve(right);
  if (factor.info() != Eigen::Success || !solution.allFinite()) return false;
  field.control = solution.head(controls);
  field.scale = solution[controls];
  return true;
}

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
                    DepthField& field, std::vector<double>& weights) {
  for (int round = 0; round < kReweightings; ++round) {
    if (!solve(samples, weights, penalty, field)) return false;
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

  std::vector<double> weights;
  for (const FieldSample& sample : samples) weights.push_back(sample.weight);
  if (!solve_robustly(samples, kFirstPenalty, min_sigma, field, weights)) return std::nullopt;

  // Every fifth sample, by their order, is left out; wrong ones were unmasked above and the mean
  // over the rest is weighted accordingly.
  double best_penalty = kFirstPenalty, best_error = std::numeric_limits<double>::infinity();
  for (const double penalty : kPenalties) {
    DepthField trial = field;
    std::vector<double> training = weights;
    for (std::size_t s = 0; s < samples.size(); s += kFold) training[s] = 0.0;
    if (!solve(samples, training, penalty, trial)) continue;
    find_residuals(samples, trial);
    double error = 0.0, total = 0.0;
    for (std::size_t s = 0; s < samples.size(); s += kFold) {
      error += weights[s] * std::abs(trial.residuals[s]);
      total += weights[s];
    }
    if (total > 0.0 && error / total < best_error)
      best_error = error / total, best_penalty = penalty;
  }
  if (!solve_robustly(samples, best_penalty, min_sigma, field, weights)) return std::nullopt;
  field.held_out = best_error;
  for (const double residual : field.residuals)
    field.kept.push_back(std::abs(residual) <= kKeptSigmas * field.sigma);
  return field;
}

}  // namespace rugae
