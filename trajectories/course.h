#pragma once
// The style of a trajectory: which places of the tube it visits, in which order, and where it looks
// there.

#include <cstdint>
#include <vector>

#include "trajectories/trajectory.h"
#include "trajectories/tube.h"

namespace rugae {

/// What the planner may change to bring a path to its length.
struct CourseSize {
  double passes = 2.0;
  int loops = 0;
  double loop_mm = 0.0;  // radius of the local loops
  double reach = 1.0;    // share of the tube's length that is visited
};

/// A way through the tube as a function of tau in [0, 1]. Without loops it runs to and fro along
/// the axis; with loops it moves from station to station, lingering at each for its loops.
class Course {
 public:
  Course(const Tube& tube, const TrajectoryOptions& options, std::uint64_t seed);

  Vec3 position(const CourseSize& size, double tau) const;
  Rigid3 world_from_camera(const CourseSize& size, double tau) const;

 private:
  struct Place {
    double along_mm;
    double around_rad;    // direction from the axis in which the station lies
    double offset_share;  // of the way from the axis to the edge
    double shift_along_mm, shift_around_mm, shift_away_mm;  // of the loop
  };
  Place place(const CourseSize& size, double tau) const;
  Vec3 point(const Place& place) const;
  double noise(const std::vector<double>& values, double tau) const;

  const Tube& tube_;
  TrajectoryOptions options_;
  double start_rad_ = 0.0, hand_ = 1.0;
  bool from_far_end_ = false;
  Vec3 phases_;
  std::vector<double> loop_size_, sway_around_, sway_along_;  // spline control values in [-1, 1]
};

}  // namespace rugae
