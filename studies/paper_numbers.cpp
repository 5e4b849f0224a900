#include "studies/paper_numbers.h"

#include <array>

#include "core/units.h"

namespace rugae {
namespace {

struct Row {
  const char* preset;
  const char* name;
  std::array<double, 6> ate_cm;
  std::array<double, 6> map_cm;  // 0: not given
};
const std::array<Row, 4> kRows = {
    {{"potensic-mini", "Potensic", {4.10, 4.14, 5.23, 5.53, 6.32, 7.73}, {2.82, 2.56, 3.16}},
     {"misumi-v3506", "Misumi-I", {4.23, 4.45, 5.54, 5.67, 5.45, 6.72}, {2.32, 2.45, 2.76}},
     {"misumi-v5506",
      "Misumi-II",
      {4.17, 4.32, 5.43, 5.47, 5.32, 6.51},
      {2.14, 2.16, 2.45, 3.14, 3.52, 3.82}},
     {"awaiba-naneye", "Awaiba", {6.93, 7.12, 7.42, 7.51, 8.32, 8.73}, {3.42, 4.14, 4.45}}}};

}  // namespace

PaperNumbers paper_numbers(const std::string& camera, const std::string& trajectory) {
  PaperNumbers numbers;
  if (trajectory.size() != 1 || trajectory < "1" || trajectory > "6") return numbers;
  const auto column = static_cast<std::size_t>(trajectory[0] - '1');
  for (const Row& row : kRows) {
    if (camera != row.preset) continue;
    numbers.ate_rmse_mm = mm_from_cm(row.ate_cm[column]);
    if (row.map_cm[column] > 0.0) numbers.map_mean_mm = mm_from_cm(row.map_cm[column]);
  }
  return numbers;
}

std::string paper_camera(const std::string& camera) {
  for (const Row& row : kRows)
    if (camera == row.preset) return row.name;
  return camera;
}

}  // namespace rugae
