#include "render/tracks.h"

#include <algorithm>

#include "core/random.h"

namespace rugae {
namespace {

constexpr int kFrames = 16;
constexpr int kAttempts = 64;  // a point, where pixels see no wall

// floor(n word / 2^32): uniform in 0 to n - 1.
std::size_t scaled(std::uint32_t word, std::size_t n) {
  return static_cast<std::size_t>((static_cast<std::uint64_t>(word) * n) >> 32);
}

Hit as_hit(const TrackPoint& point) { return {point.triangle, 0.0, point.b1, point.b2}; }

}  // namespace

std::vector<TrackPoint> choose_track_points(const FrameRenderer& renderer,
                                            const SceneMotion& motion, int frames, int count,
                                            std::uint64_t seed) {
  const RayTable& rays = renderer.rays();
  const int chosen = std::min(kFrames, frames);
  std::vector<TrackPoint> points;
  // Frame by frame, since a moving wall is costly to set up.
  for (int j = 0; j < chosen; ++j) {
    const int first = static_cast<int>(static_cast<std::int64_t>(frames) * j / chosen),
              end = static_cast<int>(static_cast<std::int64_t>(frames) * (j + 1) / chosen);
    const auto word = random_words(seed, Purpose::track_points, 0, static_cast<std::uint64_t>(j));
    const FrameView view = motion.view(
        first + static_cast<int>(scaled(word[0], static_cast<std::size_t>(end - first))));
    const std::vector<Instant> instants = view.instants(rays.height);
    const Wall& wall = renderer.wall_of(view);
    for (int k = j; k < count; k += chosen)
      for (int attempt = 0; attempt < kAttempts; ++attempt) {
        const auto draw =
            random_words(seed, Purpose::track_points, static_cast<std::uint32_t>(1 + attempt),
                         static_cast<std::uint64_t>(k));
        const std::size_t pixel = scaled(draw[0], rays.size());
        const Instant& instant =
            instants[instants.size() == 1 ? 0 : pixel / static_cast<std::size_t>(rays.width)];
        const Eye eye{instant.camera_mm, instant.beat};
        const Vec3 ray = instant.world_from_camera * rays.directions_cam[pixel];
        Hit hit;
        wall.raycaster().intersect(std::span(&eye, 1), std::span(&ray, 1), std::span(&hit, 1));
        if (!hit.met()) continue;
        const double along = wall.geometric_normal(hit.triangle, instant.beat).dot(ray);
        points.push_back({k, hit.triangle, hit.b1, hit.b2, along > 0.0});
        break;
      }
  }
  std::ranges::sort(points, {}, &TrackPoint::point);
  return points;
}

std::vector<TrackSample> follow_tracks(const FrameRenderer& renderer, const FrameView& view,
                                       const std::vector<TrackPoint>& points) {
  const Wall& wall = renderer.wall_of(view);
  const LensProjector& lens = renderer.lens();
  const double middle = 0.5 * renderer.rays().height;
  std::vector<TrackSample> samples;
  std::vector<Eye> eyes;
  std::vector<Vec3> places;
  std::vector<std::uint8_t> faces;
  for (const TrackPoint& point : points) {
    const Hit hit = as_hit(point);
    const auto at = [&](double offset_s) { return wall.point(hit, view.beat(offset_s)); };
    const auto landing = view.camera.landing(lens, at, middle);
    if (!landing || !lens.contains(*landing)) continue;
    const Rigid3 pose = view.camera.at(landing->y());
    const double offset_s = view.camera.offset_s(landing->y()), beat = view.beat(offset_s);
    const Vec3 place = at(offset_s);
    const Vec3 normal = wall.geometric_normal(point.triangle, beat);
    const double away = normal.dot(place - pose.translation);
    samples.push_back({point.point, *landing, (pose.inverse() * place).z(), false});
    eyes.push_back({pose.translation, beat});
    places.push_back(place);
    faces.push_back(point.seen_along_normal ? away > 0.0 : away < 0.0);
  }
  std::vector<std::uint8_t> hidden(samples.size());
  if (!samples.empty()) wall.raycaster().hidden_from(eyes, places, faces, hidden);
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i].visible = faces[i] && !hidden[i];
  return samples;
}

}  // namespace rugae
