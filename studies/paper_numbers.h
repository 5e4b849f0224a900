#pragma once
// What the paper (Turan et al., Sparse-then-Dense Alignment based 3D Map Reconstruction Method for
// Endoscopic Capsule Robots, 2017) reports, to stand beside ours.

#include <optional>
#include <string>

namespace rugae {

struct PaperNumbers {
  std::optional<double> ate_rmse_mm;  // "Comparison of ATE RMSE for different trajectories"
  // Mean distance of the map to the scan after ICP; "Comparison of surface reconstruction
  // accuracy", for trajectories 4 to 6 on Misumi-II the last column of the table of preprocessing.
  std::optional<double> map_mean_mm;
  double seconds_per_frame_pair = 0.91915;  // section "Computational Performance"
};

/// By the names of our presets; empty numbers for a camera or trajectory the paper does not have.
PaperNumbers paper_numbers(const std::string& camera, const std::string& trajectory);

/// "Misumi-II" for "misumi-v5506"; the name itself for others.
std::string paper_camera(const std::string& camera);

}  // namespace rugae
