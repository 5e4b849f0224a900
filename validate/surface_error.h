#pragma once
// Distances between an estimated surface and the true one.

#include <optional>
#include <vector>

#include "core/mesh.h"
#include "validate/error_stats.h"

namespace rugae {

/// `count` points spread evenly by area over the triangles. Nothing random: the k-th point lies in
/// the triangle where the running area reaches (k + 1/2) / count of the whole, at barycentric
/// coordinates from the R2 sequence (the additive recurrence with the plastic number; M. Roberts,
/// The unreasonable effectiveness of quasirandom sequences, 2018), folded into the triangle.
/// Empty for a mesh without area.
std::vector<Vec3> sample_surface(const TriangleMesh& mesh, std::size_t count);

/// Distances, mm, from each point to the nearest place on the mesh (on triangles, not vertices),
/// in the order of the points.
std::vector<double> distances_mm(const std::vector<Vec3>& points, const TriangleMesh& mesh);
std::vector<double> distances_mm(const std::vector<Vec3>& points, const ClosestPoint& closest);

/// At one threshold tau: precision is the share of the estimate within tau of the truth, recall
/// the share of the truth within tau of the estimate, F their harmonic mean. Knapitsch et al.,
/// Tanks and Temples, TOG 2017, section 3, doi:10.1145/3072959.3073599.
struct Thresholded {
  double threshold_mm = 0.0, precision = 0.0, recall = 0.0, f = 0.0;
};

struct SurfaceOptions {
  std::size_t samples = 100'000;  // on each surface
  // Design: 0.25 to 2 mm; 5 and 10 mm tell maps of centimetre error apart.
  std::vector<double> thresholds_mm{0.25, 0.5, 1.0, 2.0, 5.0, 10.0};
  void check() const;
};

/// What a map says of its own error against what it is: with errors as the map's sigma claims,
/// normally distributed, 0.683 and 0.954 of the vertices are within one and two sigma, and the
/// median of error over sigma is 0.674.
struct SigmaError {
  double within_1 = 0.0, within_2 = 0.0;  // shares of the vertices
  double median_ratio = 0.0;              // of error over sigma
  double median_sigma_mm = 0.0;
};

struct SurfaceError {
  ErrorStats estimate_to_truth_mm;  // accuracy
  ErrorStats truth_to_estimate_mm;  // completeness
  // Chamfer distances: the mean of both directions' means, and of their medians.
  double chamfer_mean_mm = 0.0, chamfer_median_mm = 0.0;
  std::vector<Thresholded> at;
  std::optional<SigmaError> sigma;  // of an estimate that has them
};

/// The true surface, prepared once for many estimates. Keeps a reference to the mesh.
class TrueSurface {
 public:
  explicit TrueSurface(const TriangleMesh& truth, const SurfaceOptions& options = {});
  /// Both meshes in mm and in one world. Empty when either has no area.
  std::optional<SurfaceError> error_of(const TriangleMesh& estimate) const;

 private:
  SurfaceOptions options_;
  std::vector<Vec3> samples_;
  std::optional<ClosestPoint> closest_;
};

/// The same for one estimate.
std::optional<SurfaceError> surface_error(const TriangleMesh& estimate, const TriangleMesh& truth,
                                          const SurfaceOptions& options = {});

}  // namespace rugae
