#include "scenes/chessboard.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/check.h"
#include "scenes/scene.h"

namespace rugae {
namespace {

// Of the glossy coat: toner and coated paper, assumed.
constexpr float kGlossRoughness = 0.25f, kGlossF0 = 0.04f;
constexpr double kSharpest_mm = 1e-6;  // below it an average is a point's value

// Integral from 0 of the wave that is 1 on [0, 1), -1 on [1, 2), and so on to both sides.
double wave_integral(double u) {
  const double n = std::floor(u), within = u - n;
  return std::fmod(n, 2.0) == 0.0 ? within : 1.0 - within;
}

// Means over [from, to] of 1 within [-1, end] and of the wave there; both 0 outside.
struct Means {
  double inside, wave;
};
Means means(double from, double to, double end) {
  const double a = std::clamp(from, -1.0, end), b = std::clamp(to, -1.0, end);
  return {(b - a) / (to - from), (wave_integral(b) - wave_integral(a)) / (to - from)};
}

// Lines of the mesh along one side: the sheet's edges and the squares'.
std::vector<double> lines_mm(int corners, const ChessboardOptions& o) {
  std::vector<double> lines = {-o.square_mm - o.border_mm};
  for (int i = -1; i <= corners; ++i) lines.push_back(i * o.square_mm);
  lines.push_back(corners * o.square_mm + o.border_mm);
  return lines;
}

}  // namespace

void ChessboardOptions::check(const std::string& where) const {
  const auto in_range = [&](const char* name, double value, double low, double high) {
    rugae::check(value >= low && value <= high, "{}: {} is {}, expected {} to {}", where, name,
                 value, low, high);
  };
  in_range("columns", columns, 3, 100);
  in_range("rows", rows, 3, 100);
  in_range("square_mm", square_mm, 0.1, 100.0);
  in_range("border_mm", border_mm, 0.1, 100.0);
  in_range("white", white, 0.01, 0.95);
  in_range("black", black, 0.0, 0.95);
  in_range("gloss", gloss, 0.0, 1.0);
  rugae::check(black < white, "{}: black is {}, expected below white, which is {}", where, black,
               white);
}

Chessboard::Chessboard(const ChessboardOptions& options) : options_(options) {
  options.check("chessboard");
}

Eigen::AlignedBox2d Chessboard::extent_mm() const {
  const double before = -options_.square_mm - options_.border_mm;
  return {Vec2(before, before), Vec2(options_.columns * options_.square_mm + options_.border_mm,
                                     options_.rows * options_.square_mm + options_.border_mm)};
}

TriangleMesh Chessboard::mesh() const {
  const std::vector<double> xs = lines_mm(options_.columns, options_);
  const std::vector<double> ys = lines_mm(options_.rows, options_);
  TriangleMesh mesh;
  for (const double y : ys)
    for (const double x : xs) mesh.vertices.emplace_back(x, y, 0.0);
  mesh.normals.assign(mesh.vertices.size(), Vec3f::UnitZ());
  const int across = static_cast<int>(xs.size());
  for (int r = 0; r + 1 < static_cast<int>(ys.size()); ++r)
    for (int c = 0; c + 1 < across; ++c) {
      const int a = r * across + c, b = a + across;
      mesh.triangles.emplace_back(a, a + 1, b + 1);
      mesh.triangles.emplace_back(a, b + 1, b);
    }
  return mesh;
}

// A square is black where the waves along x and y have the same sign, so over a footprint
//   share of black = mean of inside (1 + wave_x wave_y) / 2
// which falls apart into products of means along x and along y. At a corner both means of the waves
// change sign: the average keeps the corner's place and its symmetry.
double Chessboard::albedo(double x_mm, double y_mm, double footprint_mm) const {
  const double half = 0.5 * std::max(footprint_mm, kSharpest_mm) / options_.square_mm;
  const double x = x_mm / options_.square_mm, y = y_mm / options_.square_mm;
  const Means across = means(x - half, x + half, options_.columns);
  const Means down = means(y - half, y + half, options_.rows);
  const double black_share = 0.5 * (across.inside * down.inside + across.wave * down.wave);
  return options_.white + (options_.black - options_.white) * black_share;
}

void Chessboard::sample(std::span<const MucosaPlace> places,
                        std::span<MucosaSample> samples) const {
  for (std::size_t i = 0; i < places.size(); ++i) {
    const MucosaPlace& at = places[i];
    const double grey = albedo(at.rest_position_mm.x(), at.rest_position_mm.y(), at.footprint_mm);
    samples[i] = {.albedo = Vec3f::Constant(static_cast<float>(grey)),
                  .roughness = kGlossRoughness,
                  .coverage = static_cast<float>(options_.gloss),
                  .f0 = kGlossF0};
  }
}

}  // namespace rugae
