#include <functional>

#include "core/check.h"
#include "core/presets.h"
#include "core/units.h"
#include "core/yaml.h"
#include "trajectories/trajectory.h"

namespace rugae {
namespace {

constexpr int kMaxLikes = 8;  // a chain of `like` this long goes in a circle

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
}

// `what` stands before the name in errors.
TrajectoryOptions load(const std::string& what, const std::string& name_or_path,
                       const std::filesystem::path& folder, int likes) {
  auto file = find_preset("trajectories", what,
                          folder.empty() || name_or_path.find('.') == std::string::npos
                              ? name_or_path
                              : (folder / name_or_path).string());
  YamlReader yaml = YamlReader::from_file(file);
  TrajectoryOptions options;
  std::string like;
  yaml.get("like", like);
  if (!like.empty()) {
    check(likes < kMaxLikes, "{}: like goes in a circle", yaml.where("like"));
    options = load(yaml.where("like") + ": trajectory", like, file.parent_path(), likes + 1);
  }
  options.name = file.stem().string();
  std::string track;
  yaml.get("file", track);
  if (!track.empty()) options.file = file.parent_path() / track;
  read(yaml, options);
  yaml.finish();
  check_ranges(options, [&](const std::string& field) { return place_in(yaml, field); });
  return options;
}

}  // namespace

TrajectoryOptions load_trajectory(const std::string& name_or_path) {
  return load("trajectory", name_or_path, {}, 0);
}

void TrajectoryOptions::check(const std::string& where) const {
  check_ranges(*this, [&](const std::string&) { return where; });
}

}  // namespace rugae
