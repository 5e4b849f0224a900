#include "trajectories/board_views.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/check.h"
#include "core/portable_math.h"
#include "core/random.h"
#include "core/units.h"
#include "trajectories/channels.h"

namespace rugae {
namespace {

constexpr int kLattice = 8;        // cells a side in which a board's visibility is looked at
constexpr int kMostAttempts = 64;  // a view
constexpr double kShrink = 0.96;   // of what the board takes up, an attempt
constexpr int kBisections = 30;

// A view before its distance and place are found.
struct Draft {
  double fill;
  Vec2 target;  // where the board's middle would be: (-1, -1) to (1, 1) over the picture
  Quat turned;  // the board's axes, for a camera that looks straight at it
};

Quat turn_by(double angle_rad, const Vec3& axis) {
  const SineCosine half = portable_sin_cos(0.5 * angle_rad);
  const Vec3 v = half.sine * axis;
  return {half.cosine, v.x(), v.y(), v.z()};
}

double fraction_of(double x) { return x - std::floor(x); }

class Views {
 public:
  Views(const Lens& lens, const BoardOutline& board, const BoardViewOptions& options,
        double clearance_mm, std::uint64_t seed)
      : lens_(lens),
        projector_(lens),
        board_(board),
        options_(options),
        clearance_mm_(clearance_mm),
        seed_(seed) {
    world_from_board_.translation = board.first_mm + 0.5 * (board.across_mm + board.down_mm);
    Mat3 axes;
    axes << board.across_mm.normalized(), board.down_mm.normalized(),
        board.across_mm.cross(board.down_mm).normalized();
    world_from_board_.rotation = Quat(axes);
  }

  /// world_from_camera; empty when no attempt led to a view of the whole board.
  std::optional<Rigid3> view(int index) const {
    for (int attempt = 0; attempt < kMostAttempts; ++attempt)
      if (const auto pose = placed(drawn(index, attempt))) return pose;
    return std::nullopt;
  }

 private:
  // Sizes and places follow golden-ratio sequences, so that few views already spread over all of
  // them; the sequences' starts, and what is left, are drawn.
  Draft drawn(int index, int attempt) const {
    constexpr double kGolden = 0.6180339887498949, kPlastic = 0.7548776662466927;
    const auto start = random_uniform(seed_, Purpose::trajectory, kChannelBoardStart, 0);
    // The same tilt at every attempt: drawn anew, those that fit would be the small ones.
    const auto u = random_uniform(seed_, Purpose::trajectory, kChannelBoardView,
                                  static_cast<std::uint64_t>(index));
    Draft draft;
    double size = fraction_of(start[0] + kPlastic * index);
    double most_tilt_rad = options_.most_tilt_rad, most_roll_rad = rad_from_deg(50.0);
    const SineCosine around = portable_turn(start[1] + kGolden * index);
    const Vec2 direction(around.cosine, around.sine);
    const Vec2 border = direction / direction.cwiseAbs().maxCoeff();
    const int turn = (index + static_cast<int>(8.0 * start[2])) % 8;  // of eight views
    if (turn % 2 == 1) {
      // Only a board that is upright, small and not tilted much fits into a corner.
      draft.target = {turn & 2 ? 1.0 : -1.0, turn & 4 ? 1.0 : -1.0};
      size *= 0.2;
      most_tilt_rad *= 0.35;
      most_roll_rad = rad_from_deg(4.0);
    } else {
      draft.target = turn % 4 == 2 ? border : Vec2(0.25 * u[3] * border);
    }
    draft.fill = options_.least_fill + size * (options_.most_fill - options_.least_fill);
    for (int k = 0; k < attempt; ++k) draft.fill *= kShrink;
    // Small tilts tell little, so few of them are wanted: the square root favours large ones.
    const double tilt_rad = most_tilt_rad * std::sqrt(u[0]);
    const SineCosine axis = portable_turn(u[1]);
    const double roll_rad = (2.0 * u[2] - 1.0) * most_roll_rad;
    draft.turned =
        turn_by(tilt_rad, Vec3(axis.cosine, axis.sine, 0.0)) * turn_by(roll_rad, Vec3::UnitZ());
    return draft;
  }

  // The distance at which the board takes up its share in the middle, upright; then as far towards
  // its target as the whole of it stays in the picture: straight, and then along either side.
  std::optional<Rigid3> placed(const Draft& draft) const {
    const double distance_mm = distance_for(draft.fill);
    const auto seen = [&](const Vec2& place) {
      const auto pose = posed(draft, distance_mm, place);
      return pose &&
             sees_board(projector_, board_, pose->inverse(), options_.margin_share * lens_.width,
                        clearance_mm_, options_.most_incidence_rad);
    };
    Vec2 place = Vec2::Zero();
    if (!seen(place)) return std::nullopt;
    for (const Vec2& along : {Vec2(1, 1), Vec2(1, 0), Vec2(0, 1), Vec2(1, 0)}) {
      const Vec2 way = along.cwiseProduct(draft.target - place);
      double low = 0.0, high = 1.0;
      if (seen(place + way)) low = 1.0;
      for (int i = 0; i < kBisections && low < 1.0; ++i) {
        const double middle = 0.5 * (low + high);
        (seen(place + middle * way) ? low : high) = middle;
      }
      place += low * way;
    }
    return posed(draft, distance_mm, place);
  }

  // world_from_camera with the board's middle in the line of sight of a place in the picture.
  std::optional<Rigid3> posed(const Draft& draft, double distance_mm, const Vec2& place) const {
    const Vec2 half(0.5 * lens_.width, 0.5 * lens_.height);
    const auto ray = projector_.unproject(half + half.cwiseProduct(place));
    if (!ray) return std::nullopt;
    const Quat facing = Quat::FromTwoVectors(Vec3::UnitZ(), *ray);
    const Rigid3 cam_from_board(facing * draft.turned, distance_mm * *ray);
    return world_from_board_ * cam_from_board.inverse();
  }

  double distance_for(double fill) const {
    const double half_x = 0.5 * board_.across_mm.norm(), half_y = 0.5 * board_.down_mm.norm();
    const auto filled = [&](double distance_mm) {
      double most = 0.0;
      for (const Vec2& at : {Vec2(half_x, 0.0), Vec2(0.0, half_y)}) {
        const auto pixel = projector_.project({at.x(), at.y(), distance_mm});
        if (!pixel) return 2.0;  // so near that it reaches out of the lens's view
        const Vec2 away = (*pixel - Vec2(lens_.cx, lens_.cy)).cwiseAbs();
        most = std::max({most, 2.0 * away.x() / lens_.width, 2.0 * away.y() / lens_.height});
      }
      return most;
    };
    double near_mm = 1e-3 * half_x, far_mm = 1e3 * half_x;
    for (int i = 0; i < 2 * kBisections; ++i) {
      const double middle = std::sqrt(near_mm * far_mm);
      (filled(middle) > fill ? near_mm : far_mm) = middle;
    }
    return far_mm;
  }

  const Lens& lens_;
  LensProjector projector_;
  const BoardOutline& board_;
  const BoardViewOptions& options_;
  double clearance_mm_;
  std::uint64_t seed_;
  Rigid3 world_from_board_;  // its middle, x across and y down
};

}  // namespace

bool sees_board(const LensProjector& lens, const BoardOutline& board, const Rigid3& cam_from_world,
                double margin_px, double clearance_mm, double most_incidence_rad) {
  const Vec3 normal =
      cam_from_world.rotation * board.across_mm.cross(board.down_mm).normalized();  // away from us
  const double least_cosine = portable_sin_cos(most_incidence_rad).cosine;
  for (int j = 0; j <= kLattice; ++j)
    for (int i = 0; i <= kLattice; ++i) {
      const Vec3 p = cam_from_world * (board.first_mm + board.across_mm * i / kLattice +
                                       board.down_mm * j / kLattice);
      const double range_mm = p.norm();
      if (!(range_mm > 0.0 && range_mm >= clearance_mm) ||
          !(p.dot(normal) >= least_cosine * range_mm))
        return false;
      const auto pixel = lens.project(p);
      if (!pixel) return false;
      for (const Vec2& away :
           {Vec2(margin_px, 0), Vec2(-margin_px, 0), Vec2(0, margin_px), Vec2(0, -margin_px)})
        if (!lens.contains(*pixel + away)) return false;
    }
  return true;
}

PoseTrack plan_board_views(const Lens& lens, const BoardOutline& board,
                           const BoardViewOptions& options, double clearance_mm, int frames,
                           double fps, std::uint64_t seed, const std::string& name) {
  check(frames >= 2, "trajectory '{}': {} views, expected at least 2", name, frames);
  check(fps > 0.0 && std::isfinite(fps), "trajectory '{}': {} frames a second, expected above 0",
        name, fps);
  const Views views(lens, board, options, clearance_mm, seed);
  PoseTrack track;
  for (int i = 0; i < frames; ++i) {
    const auto pose = views.view(i);
    check(pose.has_value(),
          "trajectory '{}': view {} does not see the whole board of {:.1f} x {:.1f} mm from {} mm "
          "away or more, however it is turned",
          name, i, board.across_mm.norm(), board.down_mm.norm(), clearance_mm);
    track.push_back({i / fps, *pose});
  }
  return track;
}

Rigid3 held_pose(const PoseTrack& track, double frame) {
  const double last = static_cast<double>(track.size()) - 1.0;
  return track[static_cast<std::size_t>(std::clamp(std::floor(frame + 0.5), 0.0, last))]
      .world_from_camera;
}

}  // namespace rugae
