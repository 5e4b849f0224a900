#include "synthetic.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/check.h"
#include "core/files.h"
#include "core/random.h"
#include "core/sim3.h"
#include "core/units.h"
#include "dataset/image_io.h"
#include "recon/tracks.h"

namespace rugae::synthetic {
namespace {

constexpr double kMeanRadiusMm = 40.0;
constexpr double kMaxIncidenceRad = 1.3;  // a wall seen more flatly is not tracked

Vec3 outward_normal(const Vec3& direction) {
  // Of the surface x = R(d) d, by differences along two tangents.
  const Vec3 t = direction.unitOrthogonal(), b = direction.cross(t);
  constexpr double kStep = 1e-5;
  const auto at = [&](const Vec3& d) {
    return Vec3(wall_radius_mm(d.normalized()) * d.normalized());
  };
  const Vec3 along_t = at(direction + kStep * t) - at(direction - kStep * t);
  const Vec3 along_b = at(direction + kStep * b) - at(direction - kStep * b);
  const Vec3 normal = along_t.cross(along_b).normalized();
  return normal.dot(direction) > 0.0 ? normal : Vec3(-normal);
}

// Value noise: random values on a lattice, smoothly blended; in [0, 1].
double value_noise(const Vec3& p, std::uint32_t octave) {
  const Vec3 floor = p.array().floor();
  const Vec3 f = p - floor;
  const Vec3 s = f.array().square() * (3.0 - 2.0 * f.array());
  double sum = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const int dx = corner & 1, dy = (corner >> 1) & 1, dz = corner >> 2;
    const auto cell = [](double v, int d) {
      return static_cast<std::uint64_t>(static_cast<std::int64_t>(v) + d + (1 << 19)) & 0xFFFFF;
    };
    const std::uint64_t index =
        cell(floor.x(), dx) | cell(floor.y(), dy) << 20 | cell(floor.z(), dz) << 40;
    const double weight =
        (dx ? s.x() : 1 - s.x()) * (dy ? s.y() : 1 - s.y()) * (dz ? s.z() : 1 - s.z());
    sum += weight * uniform01(random_words(77, Purpose::test, octave, index)[0]);
  }
  return sum;
}

// Mottles of 4, 2 and 1 mm.
double albedo(const Vec3& wall_mm) {
  return 0.25 + 0.3 * value_noise(wall_mm / 4.0, 1) + 0.3 * value_noise(wall_mm / 2.0, 2) +
         0.15 * value_noise(wall_mm, 3);
}

// First meeting of a ray from inside with the wall, by steps and bisection.
Vec3 wall_on_ray(const Vec3& origin, const Vec3& direction) {
  const auto inside = [&](double t) {
    const Vec3 x = origin + t * direction;
    return x.norm() < wall_radius_mm(x.normalized());
  };
  constexpr double kStepMm = 4.0;  // the folds are wider
  double low = 0.0, high = kStepMm;
  while (inside(high)) {
    low = high;
    high += kStepMm;
  }
  for (int i = 0; i < 20; ++i) {
    const double middle = 0.5 * (low + high);
    (inside(middle) ? low : high) = middle;
  }
  return origin + 0.5 * (low + high) * direction;
}

}  // namespace

double wall_radius_mm(const Vec3& d) {
  return kMeanRadiusMm *
         (1.0 + 0.06 * std::sin(5.0 * d.x() + 1.0) * std::cos(4.0 * d.y()) +
          0.04 * std::sin(9.0 * d.z() + 3.0 * d.x()) + 0.03 * std::cos(13.0 * d.y() - 5.0 * d.z()));
}

Rigid3 world_from_camera(double a) {
  const Vec3 centre(16.0 * std::cos(a), 16.0 * std::sin(a), 6.0 * std::sin(2.3 * a));
  // The camera looks outward and somewhat ahead, and rolls.
  const Vec3 z = Vec3(std::cos(a + 0.5), std::sin(a + 0.5), 0.3 * std::sin(1.7 * a)).normalized();
  const Vec3 down = Vec3(0.2 * std::sin(0.9 * a), 0.1, -1.0);
  const Vec3 y = (down - down.dot(z) * z).normalized();
  Mat3 r;
  r << y.cross(z), y, z;
  return {r, centre};
}

Lens lens_of(int width, int height) {
  Lens lens;
  lens.width = width;
  lens.height = height;
  lens.fx = lens.fy = 0.5 * width / std::tan(rad_from_deg(50.0));
  lens.cx = 0.5 * width;
  lens.cy = 0.5 * height;
  return lens;
}

double angle_of(const Options& options, int camera) {
  const bool back = options.turn_at > 0 && camera >= options.turn_at;
  return options.step_rad * (back ? 2 * options.turn_at - camera - 1.5 : camera);
}

RowPoses rows_of(const Options& options, int camera) {
  const int height = options.width * 3 / 4;
  if (options.readout_share == 0.0) return RowPoses(world_from_camera(angle_of(options, camera)));
  std::vector<Rigid3> poses;
  for (int row = -1; row <= height; ++row)
    poses.push_back(
        world_from_camera(angle_of(options, camera) +
                          options.step_rad * options.readout_share * ((row + 0.5) / height - 0.5)));
  constexpr double kFps = 30.0;
  return {std::move(poses), options.readout_share / (kFps * height)};
}

World make_world(const Options& options) {
  World world;
  world.lens = lens_of(options.width, options.width * 3 / 4);
  std::vector<Rigid3> cam_from_world_mm;
  std::vector<RowPoses> rows;
  const LensProjector projector(world.lens);
  for (int k = 0; k < options.cameras; ++k) {
    rows.push_back(rows_of(options, k));
    cam_from_world_mm.push_back(world_from_camera(angle_of(options, k)).inverse());
    Rigid3 pose = cam_from_world_mm.back().inverse();
    pose.translation *= options.unit;
    world.cam_from_world.push_back((options.moved * pose).inverse());
    world.frames.push_back(k);
  }
  for (int i = 0; i < options.points; ++i) {
    const auto normal = random_normal(options.seed, Purpose::test, 0, i);
    const Vec3 direction = Vec3(normal[0], normal[1], normal[2]).normalized();
    const Vec3 wall_mm = wall_radius_mm(direction) * direction;
    const Vec3 outward = outward_normal(direction);
    Track track;
    for (int k = options.first_camera; k < options.cameras; ++k) {
      const auto pixel = rows[k].landing(
          projector, [&](double) { return wall_mm; }, 0.5 * world.lens.height);
      const Vec3 sight = (wall_mm - cam_from_world_mm[k].inverse().translation).normalized();
      const bool seen =
          pixel && world.lens.contains(*pixel) && sight.dot(outward) >= std::cos(kMaxIncidenceRad);
      if (!seen) {
        if (!track.observations.empty()) break;
        continue;
      }
      const auto u = random_uniform(options.seed, Purpose::test, k + 1, i);
      const auto g = random_normal(options.seed, Purpose::test, k + 100001, i);
      Vec2 shift = options.noise_px * Vec2(g[0], g[1]);
      if (u[0] < options.outlier_share) shift = 40.0 * Vec2(2.0 * u[1] - 1.0, 2.0 * u[2] - 1.0);
      track.observations.push_back({k, *pixel + shift});
      if (static_cast<int>(track.observations.size()) == options.max_run) break;
    }
    if (track.observations.size() < 2) continue;
    world.points.push_back(options.moved * (options.unit * wall_mm));
    world.tracks.push_back(std::move(track));
  }
  set_rays(world.tracks, world.lens);
  return world;
}

cv::Mat picture(const Lens& lens, const RowPoses& rows, double noise_levels, std::uint64_t seed,
                int frame) {
  cv::Mat bgr(lens.height, lens.width, CV_8UC3, cv::Scalar::all(0));
  for (int y = 0; y < lens.height; ++y) {
    const Rigid3& world_from_camera = rows.of_row(y);
    for (int x = 0; x < lens.width; ++x) {
      const auto ray = lens.unproject({x + 0.5, y + 0.5});
      if (!ray) continue;
      const Vec3 direction = world_from_camera.rotation * *ray;
      const Vec3 wall = wall_on_ray(world_from_camera.translation, direction);
      const double distance = (wall - world_from_camera.translation).norm();
      const double cosine = std::max(0.0, outward_normal(wall.normalized()).dot(direction));
      const double linear = 600.0 * albedo(wall) * cosine / (distance * distance);
      const auto g = random_normal(seed, Purpose::read_noise, frame,
                                   static_cast<std::uint64_t>(y) * lens.width + x);
      const double level = 255.0 * std::pow(std::min(1.0, linear), 1.0 / 2.2) + noise_levels * g[0];
      bgr.at<cv::Vec3b>(y, x) = {cv::saturate_cast<unsigned char>(0.7 * level),
                                 cv::saturate_cast<unsigned char>(0.75 * level),
                                 cv::saturate_cast<unsigned char>(level)};
    }
  }
  return bgr;
}

Recording record(const std::filesystem::path& folder, const Lens& lens,
                 const std::vector<Rigid3>& world_from_camera, double noise_levels) {
  std::vector<RowPoses> rows;
  for (const Rigid3& pose : world_from_camera) rows.emplace_back(pose);
  Recording recording = record(folder, lens, rows, noise_levels);
  recording.world_from_camera = world_from_camera;
  return recording;
}

Recording record(const std::filesystem::path& folder, const Lens& lens,
                 const std::vector<RowPoses>& world_from_camera, double noise_levels) {
  Recording recording{folder / "images", folder / "calibration.yaml", {}};
  make_folder(recording.images);
  const double row_time_s = world_from_camera.empty() ? 0.0 : world_from_camera[0].row_time_s();
  Calibration calibration{lens, {}, {}};
  if (row_time_s > 0.0) calibration.row_time_us = 1e6 * row_time_s;
  write_atomic(recording.calibration, calibration_yaml(calibration, "synthetic"));
  for (const RowPoses& rows : world_from_camera)
    recording.world_from_camera.push_back(rows.at(0.5 * lens.height));
  for (std::size_t i = 0; i < world_from_camera.size(); ++i)
    write_image(recording.images / fmt::format("{:06}.png", i),
                picture(lens, world_from_camera[i], noise_levels, 5, static_cast<int>(i)));
  return recording;
}

Structure every_other_keyframe(Structure half) {
  for (std::size_t k = 1; k + 1 < half.placed.size(); k += 2) half.placed[k] = false;
  for (Track& track : half.tracks)
    std::erase_if(track.observations, [&](const auto& o) { return !half.placed[o.keyframe]; });
  std::erase_if(half.tracks, [](const Track& track) { return track.observations.size() < 2; });
  return half;
}

PathError path_error(const std::vector<Rigid3>& estimated, const std::vector<Rigid3>& truth) {
  std::vector<Vec3> source, target;
  Eigen::AlignedBox3d box;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    source.push_back(estimated[i].translation);
    target.push_back(truth[i].translation);
    box.extend(target.back());
  }
  const auto aligned = umeyama(source, target, true);
  check(aligned.has_value(), "the two paths cannot be aligned");
  PathError error;
  error.cameras = static_cast<int>(truth.size());
  error.path_extent = box.diagonal().norm();
  for (std::size_t i = 0; i < truth.size(); ++i) {
    error.rmse += (*aligned * source[i] - target[i]).squaredNorm();
    const Quat estimated_turn = estimated[0].rotation.conjugate() * estimated[i].rotation;
    const Quat true_turn = truth[0].rotation.conjugate() * truth[i].rotation;
    error.worst_rotation_rad =
        std::max(error.worst_rotation_rad, angle_between_rad(estimated_turn, true_turn));
  }
  error.rmse = std::sqrt(error.rmse / static_cast<double>(truth.size()));
  return error;
}

PathError path_error(const Structure& structure, const World& world) {
  std::vector<Rigid3> estimated, truth;
  for (std::size_t k = 0; k < structure.frames.size(); ++k) {
    if (!structure.placed[k]) continue;
    estimated.push_back(structure.cam_from_world[k].inverse());
    truth.push_back(world.cam_from_world[structure.frames[k]].inverse());
  }
  return path_error(estimated, truth);
}

}  // namespace rugae::synthetic
