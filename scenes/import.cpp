#include "scenes/import.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "core/check.h"
#include "core/mesh_io.h"
#include "scenes/isosurface.h"
#include "scenes/long_axis.h"
#include "scenes/mesh_repair.h"
#include "scenes/subdivide.h"

namespace rugae {
namespace {

constexpr double kLeastOrganMm = 40.0, kLargestOrganMm = 1000.0;  // longest side of the box
constexpr double kMediumTriangles = 250000.0;
constexpr int kBaseLevel = 1;     // halvings from the base mesh to the medium one
constexpr int kFacetRounds = 80;  // of smoothing: the facets of coarse files

void check_size(const TriangleMesh& mesh, double mm_per_unit, const std::string& name) {
  const double side = bounding_box(mesh).sizes().maxCoeff();
  if (side >= kLeastOrganMm && side <= kLargestOrganMm) return;
  struct Unit {
    const char* name;
    double mm;
  };
  constexpr Unit kUnits[] = {{"metres", 1000.0},    {"decimetres", 100.0}, {"inches", 25.4},
                             {"centimetres", 10.0}, {"millimetres", 1.0},  {"micrometres", 0.001}};
  for (const Unit& unit : kUnits) {
    const double then = side / mm_per_unit * unit.mm;
    if (then >= kLeastOrganMm && then <= kLargestOrganMm)
      fail(
          "{}: its longest side is {:.4g} mm, expected {} to {}; if it is in {}, set mm_per_unit: "
          "{}",
          name, side, kLeastOrganMm, kLargestOrganMm, unit.name, unit.mm);
  }
  fail("{}: its longest side is {:.4g} mm, expected {} to {}; set mm_per_unit", name, side,
       kLeastOrganMm, kLargestOrganMm);
}

TriangleMesh closed_wall(const std::filesystem::path& file, const ImportOptions& options,
                         std::vector<std::string>& notes) {
  const std::string name = file.string();
  const TriangleMesh read = read_mesh(file, options.mm_per_unit);
  check_size(read, options.mm_per_unit, name);
  const auto pieces = connected_components(read);
  check(options.component < static_cast<int>(pieces.size()),
        "{}: component is {}, the mesh has pieces 0 to {}", name, options.component,
        pieces.size() - 1);
  TriangleMesh wall = piece_of(read, pieces[options.component]);
  if (pieces.size() > 1)
    notes.push_back(fmt::format("piece {} of {} taken, {} of {} triangles", options.component,
                                pieces.size(), wall.triangles.size(), read.triangles.size()));
  if (const int turned = wind_alike(wall))
    notes.push_back(fmt::format("{} triangles turned to wind as their neighbours", turned));
  const EdgeReport edges = inspect_edges(wall);
  if (edges.open > 0) {
    check(options.open_ends == OpenEnds::cap,
          "{}: the wall has {} open edges; set open_ends: cap to close them", name, edges.open);
    for (const CappedEnd& end : cap_open_ends(wall))
      notes.push_back(fmt::format("open end of girth {:.1f} mm at ({}, {}, {}) capped",
                                  end.girth_mm, std::lround(end.centre.x()),
                                  std::lround(end.centre.y()), std::lround(end.centre.z())));
  }
  if (edges.non_manifold > 0)
    notes.push_back(
        fmt::format("{} edges are shared by three or more triangles", edges.non_manifold));
  if (options.wall == WallNormals::inward) turn_inside_out(wall);
  const double volume = signed_volume_mm3(wall);
  if (options.wall == WallNormals::automatic && volume < 0.0) {
    turn_inside_out(wall);
    notes.push_back("its normals point into the cavity; turned");
  } else {
    check(volume > 0.0, "{}: the wall encloses {:.1f} ml with normals {}; the other way is meant?",
          name, volume / 1000.0, options.wall == WallNormals::inward ? "inward" : "outward");
  }
  return wall;
}

// Even triangles on the file's surface, its facets smoothed away.
TriangleMesh even_mesh(const TriangleMesh& wall, double cell_mm, const std::string& name) {
  const ClosestPoint closest(wall);
  const DistanceField field = [&](const Vec3& p, Vec3* gradient) {
    const double distance = closest.signed_distance_mm(p);
    if (gradient) {
      const Vec3 away = p - closest(p).point;
      const double norm = away.norm();
      *gradient = norm > 1e-9 ? Vec3(away / (distance < 0.0 ? -norm : norm)) : Vec3(Vec3::Zero());
    }
    return distance;
  };
  TriangleMesh mesh = isosurface(field, bounding_box(wall), cell_mm, 3, name);
  mesh = piece_of(mesh, connected_components(mesh).front());
  smooth_taubin(mesh, kFacetRounds);
  return mesh;
}

}  // namespace

void ImportOptions::check(const std::string& where) const {
  rugae::check(mm_per_unit > 0.0 && std::isfinite(mm_per_unit),
               "{}: mm_per_unit is {}, expected above 0", where, mm_per_unit);
  rugae::check(component >= 0, "{}: component is {}, expected 0 or more", where, component);
  rugae::check(target_edge_mm == 0.0 || (target_edge_mm >= 0.2 && target_edge_mm <= 10.0),
               "{}: target_edge_mm is {}, expected 0.2 to 10, or 0", where, target_edge_mm);
  relief.check(where);
}

ImportedWall import_wall(const std::filesystem::path& file, const ImportOptions& options,
                         std::uint64_t seed, int level) {
  options.check(file.string());
  ImportedWall result;
  const TriangleMesh wall = closed_wall(file, options, result.notes);
  // a grid of cell c gives about 3 A / c^2 triangles (isosurface.h)
  const double medium_mm = options.target_edge_mm > 0.0
                               ? options.target_edge_mm
                               : std::sqrt(3.0 * area_mm2(wall) / kMediumTriangles);
  const TriangleMesh base = even_mesh(wall, medium_mm * (1 << kBaseLevel), file.string());
  result.mesh = base;
  for (int i = 0; i < level; ++i) result.mesh = subdivide_loop(result.mesh);
  result.mesh.normals = smooth_normals(result.mesh);
  if (options.with_relief) {
    const OrganAxis axis = long_axis(base);
    const double length = axis.length_mm();
    // where a stomach's folds rise and fade, as shares of its length from the fundus
    FoldZone zone{.rise_from_mm = 0.1 * length,
                  .rise_to_mm = 0.25 * length,
                  .fall_from_mm = 0.6 * length,
                  .fall_to_mm = 0.85 * length};
    const Relief relief(options.relief, zone, axis, seed);
    auto& vertices = result.mesh.vertices;
    tbb::parallel_for(std::size_t{0}, vertices.size(), [&](std::size_t v) {
      const Vec3 p = vertices[v];
      const Vec3 normal = result.mesh.normals[v].cast<double>();
      AxisPoint at = axis.locate(p);
      at.gradient = normal;
      vertices[v] = p - relief.height_mm(p, at) * normal;
    });
    result.mesh.normals = smooth_normals(result.mesh);
  }
  return result;
}

}  // namespace rugae
