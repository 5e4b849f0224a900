#pragma once
// Points of the wall and where frames see them: what a sparse model holds.

#include <map>
#include <opencv2/core/matx.hpp>
#include <vector>

#include "dataset/export/parts.h"

namespace rugae {

struct ColouredPoint {
  Vec3 place_mm;    // world
  cv::Vec3b color;  // RGB, of the first frame that sees it
};

class WallPoints {
 public:
  /// The followed points of a dataset that has them (`truth.tracks`) and whose wall stands still,
  /// those that two frames see at least; else points that the depth of sixteen frames puts on the
  /// wall, of which nobody knows in which other frames they are; none without depth.
  WallPoints(const ExportSource& source, Progress& progress);

  const std::vector<ColouredPoint>& points() const { return points_; }
  bool followed() const { return !number_of_.empty(); }
  /// Why there are none, or no tracks; else empty.
  const std::string& note() const { return note_; }

  struct Seen {
    std::size_t point = 0;
    Vec2 pixel;
  };
  /// Which followed points the frame sees, hidden ones left out.
  std::vector<Seen> seen_in(int frame) const;

 private:
  void follow(Progress& progress);
  void lift(Progress& progress);

  const ExportSource& source_;
  std::vector<ColouredPoint> points_;
  std::string note_;
  std::map<int, std::size_t> number_of_;  // of a followed point, among these
};

}  // namespace rugae
