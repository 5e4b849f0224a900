#include "dataset/export/points.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"
#include "core/spread.h"
#include "dataset/image_io.h"
#include "dataset/tracks.h"

namespace rugae {
namespace {

constexpr int kFewestFrames = 2;  // of a track: COLMAP's adjustment takes none of one frame
constexpr int kLiftedFrames = 16;
constexpr double kLiftedInFrame = 1200.0;  // points: enough to begin a scene of splats with

// Models of other programs see nothing beyond 90 degrees off the axis.
bool is_seen(const TrackSample& sample) { return sample.visible && sample.depth_mm > 0.0; }

cv::Vec3b rgb_at(const cv::Mat& bgr, const Vec2& pixel) {
  const cv::Vec3b color =
      bgr.at<cv::Vec3b>(static_cast<int>(pixel.y()), static_cast<int>(pixel.x()));
  return {color[2], color[1], color[0]};
}

}  // namespace

WallPoints::WallPoints(const ExportSource& source, Progress& progress) : source_(source) {
  const bool tracks = source.info.truth.tracks, moves = source.truth.wall_moves();
  if (tracks && !moves) follow(progress);
  if (followed()) return;
  const std::string why = !tracks ? "the dataset follows none (--set truth.tracks=2000 does)"
                          : moves ? "the wall moves"
                                  : "no two frames see one of them";
  if (source.info.truth.labels.depth) {
    lift(progress);
    note_ = "points are from depth, without tracks: " + why;
  } else {
    note_ = "no points: the dataset has no depth, and no tracks: " + why;
  }
}

void WallPoints::follow(Progress& progress) {
  progress.begin("followed points", static_cast<std::size_t>(source_.frames()));
  struct Sight {
    int frames = 0, first = -1;
    Vec2 pixel;  // in the first
  };
  std::map<int, Sight> sights;  // by point
  for (int frame = 0; frame < source_.frames(); ++frame) {
    for (const TrackSample& sample : source_.truth.tracks(frame)) {
      if (!is_seen(sample)) continue;
      Sight& sight = sights[sample.point];
      if (sight.frames++ == 0) sight.first = frame, sight.pixel = sample.pixel;
    }
    progress.step();
  }

  const TriangleMesh& wall = source_.truth.wall();
  const auto file = source_.layout.track_points();
  std::map<int, std::vector<std::pair<std::size_t, Vec2>>> first_in;  // of a frame
  for (const TrackPoint& point : read_track_points(file)) {
    check(point.triangle >= 0 && point.triangle < static_cast<int>(wall.triangles.size()),
          "{}: point {} is on triangle {}, of which the wall has {}", file.string(), point.point,
          point.triangle, wall.triangles.size());
    const auto sight = sights.find(point.point);
    if (sight == sights.end() || sight->second.frames < kFewestFrames) continue;
    const Vec3i& corners = wall.triangles[point.triangle];
    const double b1 = point.b1, b2 = point.b2;
    number_of_[point.point] = points_.size();
    first_in[sight->second.first].emplace_back(points_.size(), sight->second.pixel);
    points_.push_back({(1.0 - b1 - b2) * wall.vertices[corners[0]] +
                           b1 * wall.vertices[corners[1]] + b2 * wall.vertices[corners[2]],
                       {}});
  }
  for (const auto& [frame, points] : first_in) {
    const cv::Mat bgr = read_image_bgr(source_.layout.frame(frame));
    for (const auto& [point, pixel] : points) points_[point].color = rgb_at(bgr, pixel);
  }
}

void WallPoints::lift(Progress& progress) {
  const std::vector<int> frames = spread(source_.frames(), kLiftedFrames);
  progress.begin("points of the wall", frames.size());
  const Lens& lens = source_.lens();
  const LensProjector projector(lens);
  const int step =
      std::max(1, static_cast<int>(std::sqrt(lens.width * lens.height / kLiftedInFrame)));
  for (const int frame : frames) {
    const cv::Mat depth_mm = source_.truth.depth_mm(frame);
    const cv::Mat bgr = read_image_bgr(source_.layout.frame(frame));
    const RowPoses poses = source_.truth.row_poses(frame);
    for (int y = step / 2; y < lens.height; y += step)
      for (int x = step / 2; x < lens.width; x += step) {
        const Vec2 pixel(x + 0.5, y + 0.5);
        const double z = depth_mm.at<float>(y, x);
        const auto ray = projector.unproject(pixel);
        if (!(z > 0.0) || !ray || !lens.passes_stop(pixel)) continue;
        points_.push_back({poses.of_row(y) * (*ray * (z / ray->z())), rgb_at(bgr, pixel)});
      }
    progress.step();
  }
}

std::vector<WallPoints::Seen> WallPoints::seen_in(int frame) const {
  std::vector<Seen> seen;
  if (!followed()) return seen;
  for (const TrackSample& sample : source_.truth.tracks(frame))
    if (const auto found = number_of_.find(sample.point);
        is_seen(sample) && found != number_of_.end())
      seen.push_back({found->second, sample.pixel});
  return seen;
}

}  // namespace rugae
