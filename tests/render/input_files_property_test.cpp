// Camera and trajectory files: sound ones are read and render, broken ones are refused with the
// file named. The mistakes are made in what the writers write and in the presets, so that new keys
// are covered.

#include "tests/render/input_files.h"
#include "tests/render/walls.h"
#include "trajectories/trajectory.h"

namespace rugae {
namespace {

using test::check_frame;
using test::flip;
using test::InputFiles;
using test::one_of;
using test::real;
using test::some_of;
using test::text_of;
using test::whole;
using Kind = Field::Kind;

// A small camera whose distortion has an inverse up to the corners.
std::string random_camera() {
  const int width = whole(4, 40), height = whole(2, 3 * width / 4);
  const bool fisheye = flip(), rolling = flip();
  const double fps = real(1.0, 60.0), well = real(1000.0, 30000.0);
  std::string lens = fmt::format("model: {}, width: {}, height: {}, k1: {}, k2: {}",
                                 fisheye ? "kannala_brandt" : "brown_conrady", width, height,
                                 text_of(real(-0.05, 0.05)), text_of(real(0.0, 0.01)));
  if (flip()) lens += fmt::format(", k3: {}", text_of(real(0.0, 0.001)));
  if (!fisheye && flip())
    lens += fmt::format(", p1: {}, p2: {}", text_of(real(-1e-3, 1e-3)), text_of(real(-1e-3, 1e-3)));
  if (flip())
    lens += fmt::format(", horizontal_fov_deg: {}", text_of(real(20.0, 80.0)));
  else
    lens += fmt::format(", fx: {}, fy: {}", text_of(width * real(0.7, 2.0)),
                        text_of(std::max(width, height) * real(0.7, 2.0)));
  if (flip()) lens += fmt::format(", cx: {}", text_of(width * real(0.45, 0.55)));
  if (flip())
    lens +=
        fmt::format(", field_stop: {}, field_stop_radius: {}",
                    one_of<std::string>({"full", "circle", "octagon"}), text_of(real(0.1, 2.0)));
  std::string sensor = fmt::format(
      "pixel_pitch_um: {}, fps: {}, bit_depth: {}, full_well_e: {}, read_noise_e: {}, shutter: {}",
      text_of(real(0.5, 20.0)), text_of(fps), whole(8, 16), text_of(well), text_of(real(0.0, 50.0)),
      rolling ? "rolling" : "global");
  if (rolling && flip())
    sensor += fmt::format(", row_time_us: {}", text_of(real(0.01, 1.0) * 1e6 / (fps * height)));
  if (flip())
    sensor += fmt::format(", prnu: {}, dsnu_e: {}, black_level: {}", text_of(real(0.0, 0.2)),
                          text_of(real(0.0, well)), whole(0, 128));
  std::string text = fmt::format("{{lens: {{{}}}, sensor: {{{}}}", lens, sensor);
  if (flip())
    text += fmt::format(", focus: {{f_number: {}, distance_mm: {}}}", text_of(real(0.5, 100.0)),
                        text_of(real(1.0, 1e6)));
  if (flip())
    text += fmt::format(", vignetting: {{cos4: {}, v1: {}, v2: {}}}", flip(),
                        text_of(real(-0.3, 0.3)), text_of(real(-0.3, 0.3)));
  if (flip()) {
    text += ", lights: [";
    for (int n = whole(1, 3); n > 0; --n)
      text +=
          fmt::format("{{offset_mm: [{}, {}, 0], axis: [{}, 0.1, 1], lobe: {}, intensity: {}}}, ",
                      text_of(real(-3.0, 3.0)), text_of(real(-3.0, 3.0)), text_of(real(-1.0, 1.0)),
                      text_of(real(0.0, 100.0)), text_of(real(0.01, 10.0)));
    text += "]";
  }
  return text + "}\n";
}

TEST_F(InputFiles, SoundCamerasRender) {
  const TriangleMesh wall = test::folded_mesh(4);
  test::for_cases(60, [&] {
    const std::string text = random_camera();
    RC_LOG(text);
    const Camera camera = load_camera(file(text));
    const std::string written = camera_yaml(camera);
    RC_ASSERT(camera_yaml(load_camera(file(written))) == written);
    const FrameRenderer renderer(Surface(wall, test::constant_material(test::lambert(0.5f))),
                                 camera, {});
    const Rigid3 pose(test::random_rotation(static_cast<std::uint32_t>(whole(0, 99))),
                      Vec3(1.0, -2.0, 3.0));
    const Rigid3 next(pose.rotation, Vec3(1.3, -2.1, 3.2));
    check_frame(renderer.render(pose, &next));
  });
}

TEST_F(InputFiles, BrokenCamerasAreRefused) {
  std::vector<std::string> sound = presets("cameras");
  for (const std::string& name : preset_names("cameras"))
    sound.push_back(camera_yaml(load_camera(name)));
  expect_mistakes_refused(sound, [](const std::string& path) { load_camera(path); });
}

const std::vector<Field> kTrajectory = {
    {"paper_number", Kind::whole, 0, 6, {}},
    {"length_cm", Kind::real, 1.0, 10000.0, {}},
    {"clearance_mm", Kind::real, 0.0, 1000.0, {}},
    {"passes", Kind::whole, 1, 1000, {}},
    {"winding_turns", Kind::real, 0.0, 100.0, {}},
    {"retrace", Kind::flag, 0, 0, {}},
    {"offset_share", Kind::real, 0.0, 0.9, {}},
    {"read_noise_factor", Kind::real, 0.0, 1000.0, {}},
    {"oil", Kind::real, 0.0, 1.0, {}},
    {"loops.count", Kind::whole, 0, 1000, {}},
    {"loops.per_station", Kind::whole, 1, 100, {}},
    {"loops.shape", Kind::word, 0, 0, {"circle", "eight", "knot"}},
    {"view.tilt_deg", Kind::real, -40.0, 40.0, {}},
    {"view.sway_deg", Kind::real, 0.0, 120.0, {}},
    {"view.sway_cycles", Kind::real, 0.0, 200.0, {}},
    {"pace.peak_speed", Kind::real, 1.0, 1.9, {}},  // with any share
    {"pace.burst_share", Kind::real, 0.0, 0.5, {}},
    {"pace.bursts", Kind::whole, 0, 1000, {}},
    {"board.views", Kind::whole, 0, 10000, {}},
    {"board.least_fill", Kind::real, 0.05, 0.35, {}},  // below any largest one
    {"board.most_fill", Kind::real, 0.35, 0.95, {}},
    {"board.most_tilt_deg", Kind::real, 0.0, 60.0, {}},
};

TEST_F(InputFiles, SoundTrajectoriesAreRead) {
  test::for_cases(200, [&] {
    const std::string text = some_of(kTrajectory);
    RC_LOG(text);
    load_trajectory(file(text));
  });
}

TEST_F(InputFiles, BrokenTrajectoriesAreRefused) {
  std::vector<std::string> sound = presets("trajectories");
  sound.push_back(test::mapping_of(kTrajectory, [](const Field& f) {
    return f.kind == Kind::word ? f.words[0] : f.kind == Kind::flag ? "true" : text_of(f.low);
  }));
  expect_mistakes_refused(sound, [](const std::string& path) { load_trajectory(path); });
}

}  // namespace
}  // namespace rugae
