#include "studies/wall_points.h"

#include <limits>
#include <memory>

namespace rugae {

// A wall that keeps still has one mesh for all frames.
struct WallPoints::Wall {
  std::shared_ptr<const TriangleMesh> moved;  // what `own` refers to
  std::optional<Raycaster> own;
  const TriangleMesh* mesh = nullptr;
  const Raycaster* rays = nullptr;

  Vec3 at(const WallPoint& p) const {
    const Vec3i& t = mesh->triangles[static_cast<std::size_t>(p.triangle)];
    const Vec3& a = mesh->vertices[static_cast<std::size_t>(t[0])];
    const Vec3& b = mesh->vertices[static_cast<std::size_t>(t[1])];
    const Vec3& c = mesh->vertices[static_cast<std::size_t>(t[2])];
    return a + static_cast<double>(p.b1) * (b - a) + static_cast<double>(p.b2) * (c - a);
  }
};

WallPoints::WallPoints(const std::filesystem::path& dataset)
    : truth_(Truth::open(dataset)), rest_(truth_.wall()) {}

WallPoints::Wall WallPoints::wall(int frame) const {
  Wall wall;
  wall.mesh = &truth_.wall();
  wall.rays = &rest_;
  if (!truth_.wall_moves()) return wall;
  wall.moved = std::make_shared<const TriangleMesh>(truth_.wall(frame));
  wall.mesh = wall.moved.get();
  wall.own.emplace(*wall.moved);
  wall.rays = &*wall.own;
  return wall;
}

std::vector<WallPoint> WallPoints::seen(int frame, std::span<const Vec2> pixels) const {
  const Wall wall = this->wall(frame);
  const LensProjector lens(truth_.camera().lens);
  const RowPoses poses = truth_.row_poses(frame);
  std::vector<Eye> eyes;
  std::vector<Vec3> directions;
  for (const Vec2& pixel : pixels) {
    const Rigid3 world_from_camera = poses.at(pixel.y());
    const auto ray = lens.unproject(pixel);
    eyes.push_back({world_from_camera.translation, 0.0});
    directions.push_back(ray ? (world_from_camera.rotation * *ray).normalized() : Vec3::Zero());
  }
  std::vector<Hit> hits(pixels.size());
  wall.rays->intersect(eyes, directions, hits, RayOrder::scattered);
  std::vector<WallPoint> points;
  for (const Hit& hit : hits) points.push_back({hit.triangle, hit.b1, hit.b2});
  return points;
}

std::vector<std::optional<Vec2>> WallPoints::pixels(int frame,
                                                    std::span<const WallPoint> points) const {
  const Wall wall = this->wall(frame);
  const Lens& lens = truth_.camera().lens;
  const LensProjector projector(lens);
  const RowPoses poses = truth_.row_poses(frame);
  std::vector<std::optional<Vec2>> seen(points.size());
  std::vector<Eye> eyes(points.size());
  std::vector<Vec3> places(points.size(), Vec3::Zero());
  std::vector<std::uint8_t> wanted(points.size(), 0), hidden(points.size(), 0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i].triangle < 0) continue;
    const Vec3 place = wall.at(points[i]);
    const auto pixel = poses.landing(
        projector, [&](double) { return place; }, 0.5 * lens.height);
    if (!pixel || !lens.contains(*pixel)) continue;
    seen[i] = pixel;
    eyes[i] = {poses.at(pixel->y()).translation, 0.0};
    places[i] = place;
    wanted[i] = 1;
  }
  wall.rays->hidden_from(eyes, places, wanted, hidden, RayOrder::scattered);
  for (std::size_t i = 0; i < points.size(); ++i)
    if (hidden[i] != 0) seen[i].reset();
  return seen;
}

std::vector<double> WallPoints::depths_mm(int frame, std::span<const Vec3> rays) const {
  const Wall wall = this->wall(frame);
  const Rigid3 world_from_camera =
      truth_.track()[static_cast<std::size_t>(frame)].world_from_camera;
  std::vector<Vec3> directions;
  for (const Vec3& ray : rays)
    directions.push_back((world_from_camera.rotation * ray).normalized());
  std::vector<Hit> hits(rays.size());
  wall.rays->intersect(world_from_camera.translation, directions, hits);
  std::vector<double> depths;
  for (std::size_t i = 0; i < rays.size(); ++i)
    depths.push_back(hits[i].met() ? hits[i].range_mm / rays[i].norm()
                                   : std::numeric_limits<double>::quiet_NaN());
  return depths;
}

}  // namespace rugae
