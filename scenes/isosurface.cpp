#include "scenes/isosurface.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

#include "core/check.h"
#include "scenes/cell_sheets.h"

namespace rugae {
namespace {

constexpr int kBlock = 4;  // cells along a block's edge
constexpr int kCorners = kBlock + 1;

// A cell that the surface passes through. A simple one is cut by one sheet, whose vertex is the
// mean of the cuts; the others keep their cuts until their sheets are known.
struct CutCell {
  std::int64_t key;
  CornerMask inside;
  Vec3 vertex;    // of a simple cell
  int cuts = -1;  // index into BlockSurface::cuts of another
};
using Cuts = std::array<Vec3, 12>;
struct GridEdge {
  std::int64_t cell;  // the edge starts at the cell's lowest corner
  int axis;
  bool leaves;  // from inside to outside along the axis
};
struct BlockSurface {
  std::vector<CutCell> cells;
  std::vector<Cuts> cuts;
  std::vector<GridEdge> edges;
};

struct Grid {
  Vec3 origin;
  double cell_mm;
  Vec3i blocks;

  std::int64_t key(int x, int y, int z) const {
    const std::int64_t nx = blocks.x() * kBlock + 2, ny = blocks.y() * kBlock + 2;
    return x + 1 + nx * (y + 1 + ny * (z + 1));
  }
  std::int64_t stride(int axis) const {
    const std::int64_t nx = blocks.x() * kBlock + 2, ny = blocks.y() * kBlock + 2;
    return axis == 0 ? 1 : axis == 1 ? nx : nx * ny;
  }
  Vec3 corner(int x, int y, int z) const { return origin + cell_mm * Vec3(x, y, z); }
};

BlockSurface surface_in_block(const DistanceField& field, const Grid& grid, const Vec3i& first) {
  BlockSurface out;
  const double half = 0.5 * kBlock * grid.cell_mm;
  const double reach = kSteepestField * std::sqrt(3.0) * half;
  const Vec3 centre = grid.corner(first.x(), first.y(), first.z()) + Vec3::Constant(half);
  if (std::abs(field(centre, nullptr)) > reach) return out;

  std::array<double, kCorners * kCorners * kCorners> value;
  const auto at = [&](int x, int y, int z) -> double& {
    return value[x + kCorners * (y + kCorners * z)];
  };
  for (int z = 0; z < kCorners; ++z)
    for (int y = 0; y < kCorners; ++y)
      for (int x = 0; x < kCorners; ++x)
        at(x, y, z) = field(grid.corner(first.x() + x, first.y() + y, first.z() + z), nullptr);

  for (int z = 0; z < kBlock; ++z)
    for (int y = 0; y < kBlock; ++y)
      for (int x = 0; x < kBlock; ++x) {
        const std::int64_t cell = grid.key(first.x() + x, first.y() + y, first.z() + z);
        CornerMask inside = 0;
        for (int c = 0; c < 8; ++c)
          if (at(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2)) < 0.0) inside |= 1 << c;
        if (inside == 0 || inside == 255) continue;
        Cuts cuts;
        Vec3 sum = Vec3::Zero();
        int count = 0;
        for (int axis = 0; axis < 3; ++axis)
          for (int side = 0; side < 4; ++side) {
            Vec3i a(x, y, z);
            a[(axis + 1) % 3] += side & 1;
            a[(axis + 2) % 3] += side >> 1;
            Vec3i b = a;
            ++b[axis];
            const double va = at(a.x(), a.y(), a.z()), vb = at(b.x(), b.y(), b.z());
            if ((va < 0.0) == (vb < 0.0)) continue;
            if (side == 0) out.edges.push_back({cell, axis, va < 0.0});
            Vec3 p = (first + a).cast<double>();
            p[axis] += va / (va - vb);
            cuts[4 * axis + side] = grid.origin + grid.cell_mm * p;
            sum += cuts[4 * axis + side];
            ++count;
          }
        CutCell cut{cell, inside, sum / count, -1};
        if (ambiguous_faces(inside) || cell_sheets(inside, 0).count > 1) {
          cut.cuts = static_cast<int>(out.cuts.size());
          out.cuts.push_back(cuts);
        }
        out.cells.push_back(cut);
      }
  return out;
}

double least_angle_cos(const Vec3& a, const Vec3& b, const Vec3& c) {
  const auto cosine = [](const Vec3& u, const Vec3& v) {
    return u.dot(v) / std::sqrt(u.squaredNorm() * v.squaredNorm() + 1e-30);
  };
  return std::max({cosine(b - a, c - a), cosine(a - b, c - b), cosine(a - c, b - c)});
}

void relax(TriangleMesh& mesh, const std::vector<std::array<int, 4>>& quads,
           const DistanceField& field, int rounds) {
  const std::size_t count = mesh.vertices.size();
  std::vector<int> degree(count, 0);
  for (const auto& q : quads)
    for (int v : q) ++degree[v];
  std::vector<Vec3> mean(count);
  for (int round = 0; round <= rounds; ++round) {
    if (round > 0) {
      std::fill(mean.begin(), mean.end(), Vec3::Zero());
      for (const auto& q : quads)
        for (int k = 0; k < 4; ++k)  // every edge is met from both of its quads
          mean[q[k]] += 0.5 * (mesh.vertices[q[(k + 1) % 4]] + mesh.vertices[q[(k + 3) % 4]]);
    }
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t v) {
      Vec3 p =
          round > 0 ? Vec3(0.5 * mesh.vertices[v] + 0.5 * mean[v] / degree[v]) : mesh.vertices[v];
      Vec3 gradient;
      const int newton_steps = round == rounds ? 3 : 1;
      for (int step = 0; step < newton_steps; ++step) {
        const double distance = field(p, &gradient);
        p -= (distance / std::max(gradient.squaredNorm(), 1e-4)) * gradient;
      }
      mesh.vertices[v] = p;
    });
  }
}

// The vertices, and which of them an edge of a cell leads to.
class SheetVertices {
 public:
  SheetVertices(const std::vector<BlockSurface>& surfaces, const Grid& grid,
                std::vector<Vec3>& vertices) {
    std::size_t total = 0;
    for (const auto& s : surfaces) total += s.cells.size();
    first_.reserve(total);
    vertices.reserve(total);
    std::unordered_map<std::int64_t, Complex> complex;
    for (const auto& s : surfaces)
      for (const CutCell& c : s.cells)
        if (c.cuts >= 0) complex.emplace(c.key, Complex{c.inside, 0, cell_sheets(c.inside, 0)});
    invert_pinched_faces(complex, surfaces, grid);
    for (const auto& s : surfaces)
      for (const CutCell& c : s.cells) {
        const int base = static_cast<int>(vertices.size());
        first_.emplace(c.key, c.cuts < 0 ? base : ~base);
        if (c.cuts < 0) {
          vertices.push_back(c.vertex);
          continue;
        }
        Complex& cell = complex.at(c.key);
        for (int sheet = 0; sheet < cell.sheets.count; ++sheet) {
          Vec3 sum = Vec3::Zero();
          int count = 0;
          for (int e = 0; e < 12; ++e)
            if (cell.sheets.of_edge[e] == sheet) {
              sum += s.cuts[c.cuts][e];
              ++count;
            }
          vertices.push_back(sum / count);
        }
      }
    complex_ = std::move(complex);
  }

  /// -1 when the cell is not cut.
  int operator()(std::int64_t cell, int edge) const {
    const auto base = first_.find(cell);
    if (base == first_.end()) return -1;
    if (base->second >= 0) return base->second;
    return ~base->second + complex_.at(cell).sheets.of_edge[edge];
  }

 private:
  struct Complex {
    CornerMask inside;
    FaceMask inverted;
    CellSheets sheets;
  };

  static void invert_pinched_faces(std::unordered_map<std::int64_t, Complex>& complex,
                                   const std::vector<BlockSurface>& surfaces, const Grid& grid) {
    for (const auto& s : surfaces)
      for (const CutCell& c : s.cells) {
        if (c.cuts < 0) continue;
        const FaceMask faces = ambiguous_faces(c.inside);
        for (int axis = 0; axis < 3; ++axis) {
          if (!(faces >> (2 * axis + 1) & 1)) continue;
          const auto other = complex.find(c.key + grid.stride(axis));
          if (other == complex.end()) continue;
          Complex &low = complex.at(c.key), &high = other->second;
          if (!is_pinched(low.sheets, axis, 1) || !is_pinched(high.sheets, axis, 0)) continue;
          low.inverted |= 1 << (2 * axis + 1);
          high.inverted |= 1 << (2 * axis);
          low.sheets = cell_sheets(low.inside, low.inverted);
          high.sheets = cell_sheets(high.inside, high.inverted);
        }
      }
  }

  std::unordered_map<std::int64_t, int>
      first_;  // the cell's first vertex; its complement if complex
  std::unordered_map<std::int64_t, Complex> complex_;
};

}  // namespace

TriangleMesh isosurface(const DistanceField& field, const Eigen::AlignedBox3d& box, double cell_mm,
                        int rounds, const std::string& name) {
  Grid grid{box.min() - Vec3::Constant(cell_mm), cell_mm, {}};
  for (int a = 0; a < 3; ++a)
    grid.blocks[a] =
        static_cast<int>(std::ceil((box.sizes()[a] + 2.0 * cell_mm) / (kBlock * cell_mm)));
  const std::size_t count =
      static_cast<std::size_t>(grid.blocks.x()) * grid.blocks.y() * grid.blocks.z();
  check(count < (std::size_t{1} << 27), "{}: {} mm is too fine for a wall of {:.0f} mm", name,
        cell_mm, box.sizes().maxCoeff());
  std::vector<BlockSurface> surfaces(count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    const int nx = grid.blocks.x(), ny = grid.blocks.y();
    const Vec3i block(static_cast<int>(i % nx), static_cast<int>(i / nx % ny),
                      static_cast<int>(i / nx / ny));
    surfaces[i] = surface_in_block(field, grid, kBlock * block);
  });

  TriangleMesh mesh;
  const SheetVertices vertex_at(surfaces, grid, mesh.vertices);
  std::vector<std::array<int, 4>> quads;
  quads.reserve(mesh.vertices.size());
  for (const auto& s : surfaces)
    for (const GridEdge& e : s.edges) {
      const std::int64_t u = grid.stride((e.axis + 1) % 3), w = grid.stride((e.axis + 2) % 3);
      // the four cells around the edge, turning from u to w: the normal is along the axis
      const int edge = 4 * e.axis;
      std::array<int, 4> quad{vertex_at(e.cell, edge), vertex_at(e.cell - u, edge + 1),
                              vertex_at(e.cell - u - w, edge + 3), vertex_at(e.cell - w, edge + 2)};
      check(*std::min_element(quad.begin(), quad.end()) >= 0,
            "{}: inside and outside cannot be told apart: the wall crosses itself or has edges of "
            "three triangles",
            name);
      if (!e.leaves) std::swap(quad[1], quad[3]);
      quads.push_back(quad);
    }
  check(!quads.empty(), "{}: no wall found at a cell of {} mm", name, cell_mm);
  relax(mesh, quads, field, rounds);

  mesh.triangles.reserve(2 * quads.size());
  for (const auto& q : quads) {
    mesh.triangles.emplace_back(q[0], q[1], q[2]);
    mesh.triangles.emplace_back(q[0], q[2], q[3]);
  }
  recut_quads(mesh);
  return mesh;
}

void recut_quads(TriangleMesh& mesh) {
  const auto& v = mesh.vertices;
  tbb::parallel_for(std::size_t{0}, mesh.triangles.size() / 2, [&](std::size_t k) {
    Vec3i &first = mesh.triangles[2 * k], &second = mesh.triangles[2 * k + 1];
    // first is (q0, q1, q2), second (q0, q2, q3)
    const int q0 = first[0], q1 = first[1], q2 = first[2], q3 = second[2];
    const double cut02 =
        std::max(least_angle_cos(v[q0], v[q1], v[q2]), least_angle_cos(v[q0], v[q2], v[q3]));
    const double cut13 =
        std::max(least_angle_cos(v[q1], v[q2], v[q3]), least_angle_cos(v[q1], v[q3], v[q0]));
    if (cut13 >= cut02) return;
    first = Vec3i(q1, q2, q3);
    second = Vec3i(q1, q3, q0);
  });
}

}  // namespace rugae
