#include <functional>

#include "core/check.h"
#include "core/like.h"
#include "core/presets.h"
#include "core/units.h"
#include "core/yaml.h"
#include "trajectories/trajectory.h"

namespace rugae {
namespace {

/// Where a field stands ("loops.count"), for errors: file, line and column, or a name.
using PlaceOf = std::function<std::string(const std::string& field)>;

void check_ranges(const TrajectoryOptions& o, const PlaceOf& place_of) {
  const auto in_range = [&](const char* field, double value, double low, double high) {
    check(value >= low && value <= high, "{}: {} is {}, expected {} to {}", place_of(field), field,
          value, low, high);
  };
  in_range("paper_number", o.paper_number, 0, 6);
  in_range("length_cm", o.length_cm, 1.0, 10000.0);
  in_range("clearance_mm", o.clearance_mm, 0.0, 1000.0);
  in_range("passes", o.passes, 1, 1000);
  in_range("winding_turns", o.winding_turns, 0.0, 100.0);
  in_range("offset_share", o.offset_share, 0.0, 0.9);
  in_range("loops.count", o.loops.count, 0, 1000);
  in_range("loops.per_station", o.loops.per_station, 1, 100);
  in_range("view.tilt_deg", deg_from_rad(o.view.tilt_rad), -40.0, 40.0);
  in_range("view.sway_deg", deg_from_rad(o.view.sway_rad), 0.0, 120.0);
  in_range("view.sway_cycles", o.view.sway_cycles, 0.0, 200.0);
  in_range("pace.peak_speed", o.pace.peak_speed, 1.0, 20.0);
  in_range("pace.bursts", o.pace.bursts, 0, 1000);
  in_range("pace.burst_share", o.pace.burst_share, 0.0, 0.5);
  check(o.pace.bursts == 0 || o.pace.peak_speed * o.pace.burst_share < 1.0,
        "{}: pace.peak_speed times pace.burst_share is {}, expected less than 1 (the mean speed is "
        "1)",
        place_of("pace.peak_speed"), o.pace.peak_speed * o.pace.burst_share);
  in_range("read_noise_factor", o.read_noise_factor, 0.0, 1000.0);
  in_range("oil", o.oil, 0.0, 1.0);
  in_range("board.views", o.board.count, 0, 10000);
  in_range("board.least_fill", o.board.least_fill, 0.05, 0.95);
  in_range("board.most_fill", o.board.most_fill, 0.05, 0.95);
  in_range("board.most_tilt_deg", deg_from_rad(o.board.most_tilt_rad), 0.0, 60.0);
  check(o.board.least_fill <= o.board.most_fill,
        "{}: board.least_fill is {}, expected at most board.most_fill, which is {}",
        place_of("board.least_fill"), o.board.least_fill, o.board.most_fill);
}

/// A field of a group stands where the group's reader says, any other where the file's does.
std::string place_in(YamlReader& yaml, const std::string& field) {
  const std::size_t dot = field.find('.');
  if (dot == std::string::npos) return yaml.where(field);
  const auto group = yaml.child(field.substr(0, dot));
  return group ? group->where(field.substr(dot + 1)) : yaml.where(field);
}

void read(YamlReader& yaml, TrajectoryOptions& options) {
  yaml.get("paper_number", options.paper_number);
  yaml.get("length_cm", options.length_cm);
  yaml.get("clearance_mm", options.clearance_mm);
  yaml.get("passes", options.passes);
  yaml.get("winding_turns", options.winding_turns);
  yaml.get("retrace", options.retrace);
  yaml.get("offset_share", options.offset_share);
  yaml.get("read_noise_factor", options.read_noise_factor);
  yaml.get("oil", options.oil);
  if (auto loops = yaml.child("loops")) {
    loops->get("count", options.loops.count);
    loops->get("per_station", options.loops.per_station);
    int shape = static_cast<int>(options.loops.shape);
    loops->get_choice("shape", {"circle", "eight", "knot"}, shape);
    options.loops.shape = static_cast<LoopShape>(shape);
    loops->finish();
  }
  if (auto view = yaml.child("view")) {
    view->get_deg("tilt_deg", options.view.tilt_rad);
    view->get_deg("sway_deg", options.view.sway_rad);
    view->get("sway_cycles", options.view.sway_cycles);
    view->finish();
  }
  if (auto pace = yaml.child("pace")) {
    pace->get("peak_speed", options.pace.peak_speed);
    pace->get("bursts", options.pace.bursts);
    pace->get("burst_share", options.pace.burst_share);
    pace->finish();
  }
  if (auto board = yaml.child("board")) {
    board->get("views", options.board.count);
    board->get("least_fill", options.board.least_fill);
    board->get("most_fill", options.board.most_fill);
    board->get_deg("most_tilt_deg", options.board.most_tilt_rad);
    board->finish();
  }
}

}  // namespace

TrajectoryOptions load_trajectory(const std::string& name_or_path) {
  const auto asked = find_preset("trajectories", "trajectory", name_or_path);
  TrajectoryOptions options;
  for (auto& [file, yaml] : read_like_chain("trajectories", "trajectory", asked)) {
    options.name = file.stem().string();
    std::string track;
    yaml.get("file", track);
    if (!track.empty()) options.file = file.parent_path() / track;
    read(yaml, options);
    yaml.finish();
    check_ranges(options,
                 [&yaml = yaml](const std::string& field) { return place_in(yaml, field); });
  }
  return options;
}

void TrajectoryOptions::check(const std::string& where) const {
  check_ranges(*this, [&](const std::string&) { return where; });
}

}  // namespace rugae
