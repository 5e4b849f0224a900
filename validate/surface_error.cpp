#include "validate/surface_error.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "core/check.h"

namespace rugae {
namespace {

double share_within(const std::vector<double>& distances, double threshold) {
  const auto within = std::ranges::count_if(distances, [&](double d) { return d <= threshold; });
  return static_cast<double>(within) / static_cast<double>(distances.size());
}

// At most `most` of the vertices, evenly over their order.
SigmaError sigma_error(const TriangleMesh& estimate, const ClosestPoint& truth, std::size_t most) {
  const std::size_t stride = 1 + estimate.vertices.size() / most;
  std::vector<Vec3> places;
  std::vector<double> sigmas;
  for (std::size_t v = 0; v < estimate.vertices.size(); v += stride) {
    places.push_back(estimate.vertices[v]);
    sigmas.push_back(estimate.sigma[v]);
  }
  std::vector<double> ratios = distances_mm(places, truth);
  for (std::size_t i = 0; i < ratios.size(); ++i) ratios[i] /= sigmas[i];
  SigmaError error;
  error.within_1 = share_within(ratios, 1.0);
  error.within_2 = share_within(ratios, 2.0);
  error.median_ratio = error_stats(ratios).median;
  error.median_sigma_mm = error_stats(sigmas).median;
  return error;
}

}  // namespace

void SurfaceOptions::check() const {
  rugae::check(samples > 0, "surface: samples is 0, expected above 0");
  for (const double t : thresholds_mm)
    rugae::check(t > 0.0, "surface: thresholds_mm holds {}, expected above 0", t);
}

std::vector<Vec3> sample_surface(const TriangleMesh& mesh, std::size_t count) {
  std::vector<double> area_up_to(mesh.triangles.size() + 1, 0.0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    area_up_to[t + 1] = area_up_to[t] + triangle_area_mm2(mesh, t);
  const double total = area_up_to.back();
  std::vector<Vec3> points;
  if (!(total > 0.0)) return points;
  points.reserve(count);
  // The plastic number g solves g^3 = g + 1; the steps are 1/g and 1/g^2.
  constexpr double kPlastic = 1.32471795724474602596;
  constexpr double kStepU = 1.0 / kPlastic, kStepV = 1.0 / (kPlastic * kPlastic);
  std::size_t t = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const double wanted = total * ((k + 0.5) / static_cast<double>(count));
    while (t + 1 < mesh.triangles.size() && area_up_to[t + 1] < wanted) ++t;
    double whole = 0.0;
    double u = std::modf(0.5 + kStepU * (k + 1.0), &whole);
    double v = std::modf(0.5 + kStepV * (k + 1.0), &whole);
    if (u + v > 1.0) {  // the square's far half, folded onto the triangle
      u = 1.0 - u;
      v = 1.0 - v;
    }
    const Vec3i& i = mesh.triangles[t];
    points.push_back((1.0 - u - v) * mesh.vertices[i[0]] + u * mesh.vertices[i[1]] +
                     v * mesh.vertices[i[2]]);
  }
  return points;
}

std::vector<double> distances_mm(const std::vector<Vec3>& points, const TriangleMesh& mesh) {
  return distances_mm(points, ClosestPoint(mesh));
}

std::vector<double> distances_mm(const std::vector<Vec3>& points, const ClosestPoint& closest) {
  std::vector<double> distances(points.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size(), 256),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t i = range.begin(); i < range.end(); ++i)
                        distances[i] = closest(points[i]).distance_mm;
                    });
  return distances;
}

TrueSurface::TrueSurface(const TriangleMesh& truth, const SurfaceOptions& options)
    : options_(options) {
  options_.check();
  samples_ = sample_surface(truth, options_.samples);
  if (!samples_.empty()) closest_.emplace(truth);
}

std::optional<SurfaceError> TrueSurface::error_of(const TriangleMesh& estimate) const {
  const std::vector<Vec3> of_estimate = sample_surface(estimate, options_.samples);
  if (of_estimate.empty() || samples_.empty()) return std::nullopt;
  const std::vector<double> to_truth = distances_mm(of_estimate, *closest_);
  const std::vector<double> to_estimate = distances_mm(samples_, estimate);

  SurfaceError error;
  error.estimate_to_truth_mm = error_stats(to_truth);
  error.truth_to_estimate_mm = error_stats(to_estimate);
  error.chamfer_mean_mm = 0.5 * (error.estimate_to_truth_mm.mean + error.truth_to_estimate_mm.mean);
  error.chamfer_median_mm =
      0.5 * (error.estimate_to_truth_mm.median + error.truth_to_estimate_mm.median);
  for (const double threshold : options_.thresholds_mm) {
    Thresholded at;
    at.threshold_mm = threshold;
    at.precision = share_within(to_truth, threshold);
    at.recall = share_within(to_estimate, threshold);
    const double sum = at.precision + at.recall;
    at.f = sum > 0.0 ? 2.0 * at.precision * at.recall / sum : 0.0;
    error.at.push_back(at);
  }
  if (!estimate.sigma.empty() && estimate.sigma.size() == estimate.vertices.size())
    error.sigma = sigma_error(estimate, *closest_, options_.samples);
  return error;
}

std::optional<SurfaceError> surface_error(const TriangleMesh& estimate, const TriangleMesh& truth,
                                          const SurfaceOptions& options) {
  return TrueSurface(truth, options).error_of(estimate);
}

}  // namespace rugae
