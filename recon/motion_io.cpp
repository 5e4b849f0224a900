// Motion on disk. Everything is rows of numbers: a row is read back in the order it was written.

#include <limits>
#include <nlohmann/json.hpp>

#include "core/check.h"
#include "core/files.h"
#include "recon/motion.h"

namespace rugae {
namespace {

using nlohmann::json;

constexpr const char* kFormat = "rugae motion 2";

json row_of(const Rigid3& pose) {
  const Quat& q = pose.rotation;
  const Vec3& t = pose.translation;
  return {q.x(), q.y(), q.z(), q.w(), t.x(), t.y(), t.z()};
}

Rigid3 pose_of(const json& row) {
  const auto v = row.get<std::array<double, 7>>();
  return {Quat(v[3], v[0], v[1], v[2]), Vec3(v[4], v[5], v[6])};
}

template <typename Matrix>
json row_of_matrix(const Matrix& m) {
  return std::vector<double>(m.data(), m.data() + m.size());
}

template <typename Matrix>
void read_matrix(const json& row, Matrix& m) {
  const auto values = row.get<std::vector<double>>();
  check(values.size() == static_cast<std::size_t>(m.size()), "a matrix of {} numbers, expected {}",
        values.size(), m.size());
  std::copy(values.begin(), values.end(), m.data());
}

json row_of_points(const std::vector<Vec2>& points) {
  json row = json::array();
  for (const Vec2& p : points) row.insert(row.end(), {p.x(), p.y()});
  return row;
}

std::vector<Vec2> points_of(const json& row) {
  const auto values = row.get<std::vector<double>>();
  std::vector<Vec2> points(values.size() / 2);
  for (std::size_t i = 0; i < points.size(); ++i) points[i] = {values[2 * i], values[2 * i + 1]};
  return points;
}

json json_of(const Track& track) {
  json observations = json::array();
  for (const Track::Observation& o : track.observations)
    observations.insert(observations.end(), {json(o.keyframe), json(o.pixel.x()), json(o.pixel.y()),
                                             json(o.ray.x()), json(o.ray.y()), json(o.inlier)});
  return {{"seen", observations},
          {"point", row_of_matrix(track.point)},
          {"triangulated", track.triangulated}};
}

Track track_of(const json& node) {
  constexpr std::size_t kNumbers = 6;
  Track track;
  const json& seen = node.at("seen");
  for (std::size_t i = 0; i + kNumbers <= seen.size(); i += kNumbers)
    track.observations.push_back(
        {seen[i], Vec2(seen[i + 1], seen[i + 2]), Vec2(seen[i + 3], seen[i + 4]), seen[i + 5]});
  read_matrix(node.at("point"), track.point);
  track.triangulated = node.at("triangulated");
  return track;
}

json json_of(const PairAlignment& p) {
  return {{"reference", p.reference},
          {"moving", p.moving},
          {"reference_px", row_of_points(p.reference_px)},
          {"moving_px", row_of_points(p.moving_px)},
          {"homography", row_of_matrix(p.ref_from_mov_homography)},
          {"affine", row_of_matrix(p.ref_from_mov_affine)},
          {"mse", p.mse},
          {"matches", p.matches},
          {"inliers", p.inliers},
          {"iterations", p.iterations},
          {"converged", p.converged}};
}

PairAlignment pair_of(const json& node) {
  PairAlignment p;
  p.reference = node.at("reference");
  p.moving = node.at("moving");
  p.reference_px = points_of(node.at("reference_px"));
  p.moving_px = points_of(node.at("moving_px"));
  read_matrix(node.at("homography"), p.ref_from_mov_homography);
  read_matrix(node.at("affine"), p.ref_from_mov_affine);
  p.mse = node.at("mse").is_null() ? std::numeric_limits<double>::quiet_NaN()
                                   : node.at("mse").get<double>();
  p.matches = node.at("matches");
  p.inliers = node.at("inliers");
  p.iterations = node.at("iterations");
  p.converged = node.at("converged");
  return p;
}

json json_of(const Structure& s) {
  json poses = json::array(), tracks = json::array();
  for (const Rigid3& pose : s.cam_from_world) poses.push_back(row_of(pose));
  for (const Track& track : s.tracks) tracks.push_back(json_of(track));
  return {{"frames", s.frames},
          {"scale_sigma_share", s.scale_sigma_share ? json(*s.scale_sigma_share) : json()},
          {"placed", s.placed},
          {"cam_from_world", poses},
          {"tracks", tracks},
          {"mean_reprojection_px", s.mean_reprojection_px},
          {"iterations", s.iterations},
          {"converged", s.converged}};
}

Structure structure_of(const json& node) {
  Structure s;
  s.frames = node.at("frames").get<std::vector<int>>();
  s.placed = node.at("placed").get<std::vector<bool>>();
  for (const json& row : node.at("cam_from_world")) s.cam_from_world.push_back(pose_of(row));
  for (const json& track : node.at("tracks")) s.tracks.push_back(track_of(track));
  s.mean_reprojection_px = node.at("mean_reprojection_px");
  s.iterations = node.at("iterations");
  s.converged = node.at("converged");
  if (!node.at("scale_sigma_share").is_null()) s.scale_sigma_share = node.at("scale_sigma_share");
  return s;
}

}  // namespace

void write_motion(const std::filesystem::path& file, const Motion& motion) {
  json pairs = json::array(), poses = json::array(), stages = json::array();
  for (const PairAlignment& pair : motion.pairs) pairs.push_back(json_of(pair));
  for (const auto& pose : motion.cam_from_world) poses.push_back(pose ? row_of(*pose) : json());
  for (const StageTime& s : motion.stages) stages.push_back({s.name, s.seconds, s.peak_rss_mb});
  const std::vector<std::uint8_t> bytes = json::to_cbor({{"format", kFormat},
                                                         {"structure", json_of(motion.structure)},
                                                         {"pairs", pairs},
                                                         {"cam_from_world", poses},
                                                         {"stages", stages}});
  write_atomic(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

Motion read_motion(const std::filesystem::path& file) {
  try {
    const json node = json::from_cbor(read_text(file));
    check(node.at("format") == kFormat, "format {}, expected {}", node.at("format").dump(),
          kFormat);
    Motion motion;
    motion.structure = structure_of(node.at("structure"));
    for (const json& pair : node.at("pairs")) motion.pairs.push_back(pair_of(pair));
    for (const json& row : node.at("cam_from_world"))
      motion.cam_from_world.push_back(row.is_null() ? std::optional<Rigid3>() : pose_of(row));
    for (const json& row : node.at("stages")) motion.stages.push_back({row[0], row[1], row[2]});
    return motion;
  } catch (const json::exception& error) {
    fail("{}: not the motion of a reconstruction: {}", file.string(), error.what());
  } catch (const Error& error) {
    fail("{}: {}", file.string(), error.what());
  }
}

}  // namespace rugae
