#include "studies/true_motion.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <thread>

#include "core/check.h"
#include "dataset/layout.h"

namespace rugae {
namespace {

// Two frames a thread, and the frames beside them.
std::size_t kept_frames() { return 2 * std::max(1U, std::thread::hardware_concurrency()) + 2; }

}  // namespace

// The wall around a frame's time.
struct TrueMotion::FrameWall {
  Positions now, before, after;  // null where nothing moves while the frame is read
  VertexMotion vertices;
  std::optional<Raycaster> moved;
  const Raycaster* raycaster = nullptr;
  const std::vector<Vec3i>* triangles = nullptr;

  Vec3 point(const Hit& hit, double beat) const {
    const Vec3i& t = (*triangles)[static_cast<std::size_t>(hit.triangle)];
    const double b1 = hit.b1, b2 = hit.b2;
    return (1.0 - b1 - b2) * vertices(t[0], beat) + b1 * vertices(t[1], beat) +
           b2 * vertices(t[2], beat);
  }
  // Of any length, by the winding.
  Vec3 normal(int triangle, double beat) const {
    const Vec3i& t = (*triangles)[static_cast<std::size_t>(triangle)];
    const Vec3 a = vertices(t[0], beat);
    return (vertices(t[1], beat) - a).cross(vertices(t[2], beat) - a);
  }
};

TrueMotion::TrueMotion(const std::filesystem::path& dataset)
    : truth_(Truth::open(dataset)), lens_(truth_.camera().lens), at_rest_(truth_.wall()) {
  moves_ = std::filesystem::exists(DatasetLayout{dataset}.wall_motion(0));
  if (moves_) return;
  auto wall = std::make_shared<FrameWall>();
  wall->vertices = {&truth_.wall().vertices};
  wall->raycaster = &at_rest_;
  wall->triangles = &truth_.wall().triangles;
  still_ = std::move(wall);
}

TrueMotion::~TrueMotion() = default;

// What is not there is made outside the lock: two threads may make the same, none waits for
// another.
template <typename T, typename Make>
std::shared_ptr<const T> TrueMotion::find(Kept<T>& kept, int frame, Make make) const {
  {
    const std::lock_guard lock(mutex_);
    for (auto entry = kept.begin(); entry != kept.end(); ++entry) {
      if (entry->first != frame) continue;
      kept.splice(kept.begin(), kept, entry);
      return kept.front().second;
    }
  }
  std::shared_ptr<const T> made = make();
  const std::lock_guard lock(mutex_);
  kept.emplace_front(frame, made);
  if (kept.size() > kept_frames()) kept.pop_back();
  return made;
}

// Before the first and after the last frame the wall stands still.
TrueMotion::Positions TrueMotion::positions(int frame) const {
  const int held = std::clamp(frame, 0, truth_.size() - 1);
  return find(positions_, held, [&] {
    return std::make_shared<const std::vector<Vec3>>(truth_.wall(held).vertices);
  });
}

std::shared_ptr<const TrueMotion::FrameWall> TrueMotion::wall(int frame) const {
  if (still_) return still_;
  return find(walls_, frame, [&]() -> std::shared_ptr<const FrameWall> {
    auto wall = std::make_shared<FrameWall>();
    wall->now = positions(frame);
    wall->vertices.now = wall->now.get();
    if (truth_.camera().sensor.shutter == Shutter::rolling) {
      wall->before = positions(frame - 1);
      wall->after = positions(frame + 1);
      wall->vertices.before = wall->before.get();
      wall->vertices.after = wall->after.get();
    }
    wall->moved.emplace(at_rest_, wall->vertices);
    wall->raycaster = &*wall->moved;
    wall->triangles = &truth_.wall().triangles;
    return wall;
  });
}

std::vector<TrueLanding> TrueMotion::follow(int from, int to, std::span<const Vec2> pixels) const {
  check(from >= 0 && to >= 0 && from < truth_.size() && to < truth_.size(),
        "true motion from frame {} to {}: the dataset has {}", from, to, truth_.size());
  const std::size_t n = pixels.size();
  const RowPoses now = truth_.row_poses(from), then = truth_.row_poses(to);
  const std::shared_ptr<const FrameWall> wall_now = wall(from), wall_then = wall(to);
  const double fps = truth_.camera().sensor.fps;

  std::vector<Eye> eyes(n);
  std::vector<Vec3> rays(n, Vec3::Zero());  // world; zero meets nothing
  for (std::size_t i = 0; i < n; ++i) {
    const auto ray = lens_.unproject(pixels[i]);
    if (!ray) continue;
    const double line = pixels[i].y();
    const Rigid3 pose = now.at(line);
    eyes[i] = {pose.translation, fps * now.offset_s(line)};
    rays[i] = pose.rotation * *ray;
  }
  std::vector<Hit> hits(n);
  if (n > 0) wall_now->raycaster->intersect(eyes, rays, hits, RayOrder::scattered);

  std::vector<TrueLanding> landings(n);
  std::vector<Eye> looks(n);
  std::vector<Vec3> places(n, Vec3::Zero());
  std::vector<std::uint8_t> faces(n, 0), hidden(n, 0);
  for (std::size_t i = 0; i < n; ++i) {
    const Hit& hit = hits[i];
    if (!hit.met()) continue;
    const Vec3 met = eyes[i].position_mm + hit.range_mm * rays[i];
    const Vec3 off = met - wall_now->point(hit, eyes[i].beat);  // rounding of the coordinates
    const auto at = [&](double offset_s) -> Vec3 {
      return off + wall_then->point(hit, fps * offset_s);
    };
    const std::optional<Vec2> landing = then.landing(lens_, at, pixels[i].y());
    if (!landing) continue;
    landings[i] = {TrueLanding::Sight::outside, *landing};
    if (!lens_.contains(*landing)) continue;
    landings[i].sight = TrueLanding::Sight::hidden;
    const double offset_s = then.offset_s(landing->y()), beat = fps * offset_s;
    looks[i] = {then.at(landing->y()).translation, beat};
    places[i] = at(offset_s);
    // In a closed wall a point turned away is hidden. It faces the frame in which it was met.
    const double side =
        wall_now->normal(hit.triangle, eyes[i].beat).dot(rays[i]) > 0.0 ? -1.0 : 1.0;
    const Vec3 view = places[i] - looks[i].position_mm;
    faces[i] = side * wall_then->normal(hit.triangle, beat).dot(view) < 0.0;
  }
  if (n > 0) wall_then->raycaster->hidden_from(looks, places, faces, hidden, RayOrder::scattered);
  for (std::size_t i = 0; i < n; ++i)
    if (faces[i] && !hidden[i]) landings[i].sight = TrueLanding::Sight::seen;
  return landings;
}

std::vector<double> TrueMotion::depths_mm(int frame, std::span<const Vec3> rays) const {
  check(frame >= 0 && frame < truth_.size(), "true depth of frame {}: the dataset has {}", frame,
        truth_.size());
  const Rigid3 pose = truth_.track()[static_cast<std::size_t>(frame)].world_from_camera;
  const std::vector<Eye> eyes(rays.size(), {pose.translation, 0.0});
  std::vector<Vec3> directions;
  for (const Vec3& ray : rays) directions.push_back((pose.rotation * ray).normalized());
  std::vector<Hit> hits(rays.size());
  wall(frame)->raycaster->intersect(eyes, directions, hits, RayOrder::scattered);
  std::vector<double> depths;
  for (std::size_t i = 0; i < rays.size(); ++i)
    depths.push_back(hits[i].met() ? hits[i].range_mm / rays[i].norm()
                                   : std::numeric_limits<double>::quiet_NaN());
  return depths;
}

}  // namespace rugae
