#include "dataset/tracks.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <opencv2/core/mat.hpp>

#include "core/check.h"
#include "dataset/csv.h"
#include "dataset/image_io.h"

namespace rugae {
namespace fs = std::filesystem;
namespace {

const std::string kPointsHeader = "point,triangle,b1,b2";
const std::string kTracksHeader = "point,x,y,depth_mm,visible";

// The triangles of a frame, each once.
std::vector<int> triangles_in(const fs::path& file) {
  const cv::Mat image = read_exr(file);
  check(image.type() == CV_32FC3, "{}: {} channels, expected 3", file.string(), image.channels());
  std::vector<int> seen;
  for (int y = 0; y < image.rows; ++y) {
    const auto* row = image.ptr<cv::Vec3f>(y);
    for (int x = 0; x < image.cols; ++x)
      if (std::isfinite(row[x][0])) seen.push_back(static_cast<int>(row[x][0]));
  }
  std::ranges::sort(seen);
  seen.erase(std::unique(seen.begin(), seen.end()), seen.end());
  return seen;
}

}  // namespace

std::string track_points_text(const std::vector<TrackPoint>& points) {
  std::string text = kPointsHeader + "\n";
  for (const TrackPoint& p : points)
    text += fmt::format("{},{},{:.9g},{:.9g}\n", p.point, p.triangle, p.b1, p.b2);
  return text;
}

std::string tracks_text(const std::vector<TrackSample>& samples) {
  std::string text = kTracksHeader + "\n";
  for (const TrackSample& s : samples)
    text += fmt::format("{},{:.17g},{:.17g},{:.17g},{}\n", s.point, s.pixel.x(), s.pixel.y(),
                        s.depth_mm, s.visible ? 1 : 0);
  return text;
}

std::vector<TrackPoint> read_track_points(const fs::path& file) {
  std::vector<TrackPoint> points;
  for (const CsvLine& line : read_csv(file, kPointsHeader))
    points.push_back({static_cast<int>(csv_number(file, line, 0)),
                      static_cast<int>(csv_number(file, line, 1)),
                      static_cast<float>(csv_number(file, line, 2)),
                      static_cast<float>(csv_number(file, line, 3))});
  return points;
}

std::vector<TrackSample> read_tracks(const fs::path& file) {
  std::vector<TrackSample> samples;
  for (const CsvLine& line : read_csv(file, kTracksHeader))
    samples.push_back({static_cast<int>(csv_number(file, line, 0)),
                       Vec2(csv_number(file, line, 1), csv_number(file, line, 2)),
                       csv_number(file, line, 3), csv_number(file, line, 4) != 0.0});
  return samples;
}

std::string coverage_text(const std::vector<fs::path>& files) {
  std::map<int, int> frames_of;
  std::mutex mutex;
  tbb::parallel_for(std::size_t{0}, files.size(), [&](std::size_t i) {
    const std::vector<int> seen = triangles_in(files[i]);
    const std::lock_guard lock(mutex);
    for (const int triangle : seen) ++frames_of[triangle];
  });
  std::string text = "triangle,frames\n";
  for (const auto& [triangle, frames] : frames_of) text += fmt::format("{},{}\n", triangle, frames);
  return text;
}

}  // namespace rugae
