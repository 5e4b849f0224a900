#include "render/simulate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <opencv2/core.hpp>
#include <set>

#include "core/check.h"
#include "core/files.h"
#include "dataset/check_dataset.h"
#include "dataset/check_surface_labels.h"
#include "dataset/frame_list.h"
#include "dataset/image_io.h"
#include "dataset/label_images.h"
#include "dataset/layout.h"
#include "dataset/observations.h"
#include "dataset/truth.h"
#include "dataset/writer.h"
#include "render/isp.h"
#include "tests/render/simulate_fixture.h"

namespace rugae {
namespace {

TEST_F(Simulate, WritesASoundDataset) {
  const SimulateResult result = run("a");
  EXPECT_EQ(result.frames, 7);
  EXPECT_EQ(result.skipped, 0);
  EXPECT_GT(result.path_length_mm, 10.0);
  EXPECT_GT(result.min_clearance_mm, 5.0);
  EXPECT_GT(result.trace_s + result.shade_s + result.label_s + result.sensor_s + result.encode_s,
            0.0);
  const DatasetCheck found = check_dataset(root_ / "a");
  EXPECT_EQ(found.problems, std::vector<std::string>{});
  EXPECT_EQ(found.frames, 7);
  const Truth truth = Truth::open(root_ / "a");
  EXPECT_EQ(truth.size(), 7);
  const Observations seen = Observations::open(root_ / "a");
  EXPECT_EQ(seen.size(), 7);
  EXPECT_EQ(seen.image(3).cols, 64);
}

TEST_F(Simulate, TwoRunsAndAnyThreadsWriteTheSameBytes) {
  options_.threads = 1;
  run("one");
  run("again");
  options_.threads = 2;
  run("two");
  expect_same("one", "again");
  expect_same("one", "two");
}

// A wall that moves, rows exposed one after the other, every label.
TEST_F(Simulate, AMovingWallThroughARollingShutter) {
  write_atomic(root_ / "scene.yaml",
               "kind: mesh\nmesh: wall.ply\ntarget_edge_mm: 4\nwith_relief: false\n"
               "deformation: {peristalsis: true, breathing: true, waves_per_minute: 3, "
               "breaths_per_minute: 30}\n");
  write_atomic(root_ / "camera.yaml",
               "name: small\nframes_in_paper: 6\ndiameter_mm: 4\n"
               "lens: {model: brown_conrady, width: 64, height: 48, horizontal_fov_deg: 90, "
               "k1: -0.1}\n"
               "sensor: {pixel_pitch_um: 3, fps: 30, bit_depth: 10, full_well_e: 9000, "
               "read_noise_e: 5, shutter: rolling, row_time_us: 500}\n");
  options_.render.truth = {.labels = LabelSet::all(), .tracks = 50, .coverage = true};
  options_.render.light = {.bounces = 1, .samples = 2};
  options_.render.output.radiance = true;
  options_.threads = 1;
  run("whole");
  const DatasetCheck found = check_dataset(root_ / "whole");
  EXPECT_EQ(found.problems, std::vector<std::string>{});
  EXPECT_TRUE(found.worst_flow_px >= 0.0 && found.worst_flow_px <= 0.01) << found.worst_flow_px;

  const Truth truth = Truth::open(root_ / "whole");
  const RowPoses rows = truth.row_poses(3);
  ASSERT_TRUE(rows.rolling());
  EXPECT_DOUBLE_EQ(1e6 * Observations::open(root_ / "whole").row_time_s(), 500.0);
  EXPECT_EQ(rows.poses().size(), 50u);
  EXPECT_NEAR((rows.at(24.0).translation - truth.track()[3].world_from_camera.translation).norm(),
              0.0, 1e-3);
  EXPECT_GT((rows.of_row(47).translation - rows.of_row(0).translation).norm(), 0.5);
  EXPECT_NE(truth.wall(0).vertices, truth.wall(6).vertices);
  EXPECT_EQ(truth.wall(0).triangles, truth.wall().triangles);
  EXPECT_FALSE(fs::exists(DatasetLayout{root_ / "whole"}.backward_flow(0)));
  EXPECT_GT(truth.tracks(0).size(), 5u);
  std::map<int, int> frames_of;
  for (int i = 0; i < 7; ++i) {
    std::set<int> seen;
    const cv::Mat labels = truth.triangle(i);
    for (int k = 0; k < 64 * 48; ++k) seen.insert(static_cast<int>(labels.ptr<Vec3f>()[k][0]));
    for (const int triangle : seen) ++frames_of[triangle];
  }
  std::string coverage = "triangle,frames\n";
  for (const auto& [triangle, frames] : frames_of)
    coverage += fmt::format("{},{}\n", triangle, frames);
  EXPECT_EQ(read_text(DatasetLayout{root_ / "whole"}.coverage()), coverage);

  // The parts of the light, each in the file's units, are the frame's.
  const cv::Mat light = read_rgb_exr(DatasetLayout{root_ / "whole"}.radiance(3));
  const cv::Mat diffuse = truth.label("diffuse", 3), specular = truth.label("specular", 3),
                indirect = truth.label("indirect", 3);
  for (int k = 0; k < 64 * 48; ++k) {
    const Vec3f sum = diffuse.ptr<Vec3f>()[k] + Vec3f::Constant(specular.ptr<float>()[k]) +
                      indirect.ptr<Vec3f>()[k];
    ASSERT_TRUE((sum - light.ptr<Vec3f>()[k]).cwiseAbs().maxCoeff() <=
                1e-6f * light.ptr<Vec3f>()[k].maxCoeff());
  }

  options_.threads = 2;
  run("killed");
  const DatasetLayout layout{root_ / "killed"};
  fs::remove(layout.manifest());
  fs::remove(layout.frame_list());
  for (int i = 2; i < 7; ++i) fs::remove(layout.wall_motion(i));
  EXPECT_EQ(run("killed").frames, 7);  // the exposures went with frames.csv
  expect_same("whole", "killed");

  options_.render.lens.rolling_shutter = false;
  run("at once");
  EXPECT_FALSE(fs::exists(DatasetLayout{root_ / "at once"}.row_poses(0)));
  EXPECT_EQ(Observations::open(root_ / "at once").row_time_s(), 0.0);
  EXPECT_EQ(check_dataset(root_ / "at once").problems, std::vector<std::string>{});
  EXPECT_EQ(read_text(DatasetLayout{root_ / "at once"}.wall_motion(2)),
            read_text(layout.wall_motion(2)));
}

// Each label of the surface spoilt in one pixel: check says where and what.
TEST_F(Simulate, CheckNamesThePixelOfASpoiltLabel) {
  options_.render.truth.labels = LabelSet::all();
  options_.render.light = {.bounces = 1, .samples = 1};
  options_.render.output.radiance = true;
  options_.frames = 7;
  run("sound");
  const Truth truth = Truth::open(root_ / "sound");
  const DatasetLayout layout{root_ / "sound"};
  const LabelSources sources{layout, truth.camera().lens, truth.track(), &truth.camera(),
                             &truth.wall()};
  const NamedNumbers named = read_named_numbers(layout);
  ASSERT_TRUE(check_surface_labels(sources, named, 2).empty());
  const auto spoilt = [&](const char* name, auto spoil) {
    const LabelImage& label = label_image(name);
    const fs::path file = label.file(layout, 2);
    const std::string before = read_text(file);
    cv::Mat image = truth.label(name, 2);
    spoil(image);
    label.write(file, image);
    const auto problems = check_surface_labels(sources, named, 2);
    write_atomic(file, before);
    std::string text = problems.empty() ? "nothing" : problems.front().text;
    const std::string start = file.string() + ": at column 5, row 3 ";
    return text.starts_with(start) ? text.substr(start.size()) : text;
  };
  const auto number_at = [](cv::Mat& image) -> float& {
    return image.ptr<float>(3)[5 * image.channels()];
  };
  EXPECT_TRUE(
      spoilt("range", [&](cv::Mat& m) { number_at(m) *= 1.00001f; }).starts_with("the range is "));
  EXPECT_EQ(spoilt("albedo", [&](cv::Mat& m) { number_at(m) = 1.5f; }),
            "there is 1.5, more than all light");
  EXPECT_EQ(spoilt("albedo", [&](cv::Mat& m) { number_at(m) = -0.5f; }), "there is -0.5");
  EXPECT_EQ(
      spoilt("shading_normals", [](cv::Mat& m) { m.at<cv::Vec3f>(3, 5) = cv::Vec3f::all(NAN); }),
      "there is no normal, but a depth");
  EXPECT_EQ(spoilt("specular", [&](cv::Mat& m) { number_at(m) = NAN; }), "there is nan");
  EXPECT_TRUE(spoilt("diffuse", [&](cv::Mat& m) {
                number_at(m) *= 1.0001f;
              }).starts_with("the parts of the light add up to "));
  EXPECT_EQ(spoilt("regions", [](cv::Mat& m) { m.at<unsigned char>(3, 5) = 77; }),
            "there is 77, which regions.csv does not name");
  EXPECT_EQ(spoilt("instances", [](cv::Mat& m) { m.at<unsigned char>(3, 5) = 9; }),
            "there is 9, which instances.csv does not name");
}

TEST_F(Simulate, BlurAndDefocusLeaveTheLabelsSharp) {
  write_atomic(root_ / "camera.yaml",
               read_text(root_ / "camera.yaml") + "focus: {f_number: 0.5, distance_mm: 200}\n");
  options_.frames = 3;
  options_.render.sensor.noise = false;
  run("sharp");
  options_.render.lens.samples = 8;
  run("smooth");
  options_.render.lens.motion_blur = true;
  run("blurred");
  options_.render.lens.defocus = true;
  options_.threads = 2;
  run("soft");
  options_.threads = 1;
  run("again");
  expect_same("soft", "again");
  const auto image = [&](const char* name) {
    return read_text(DatasetLayout{root_ / name}.frame(1));
  };
  EXPECT_NE(image("sharp"), image("smooth"));
  EXPECT_NE(image("smooth"), image("blurred"));
  EXPECT_NE(image("blurred"), image("soft"));
  const DatasetLayout sharp{root_ / "sharp"}, soft{root_ / "soft"};
  EXPECT_EQ(read_text(sharp.depth(1)), read_text(soft.depth(1)));
  EXPECT_EQ(read_text(sharp.flow(1)), read_text(soft.flow(1)));
  EXPECT_EQ(read_text(sharp.frame_list()), read_text(soft.frame_list()));  // metered on the sharp
  EXPECT_EQ(check_dataset(root_ / "soft").problems, std::vector<std::string>{});
}

TEST_F(Simulate, EveryOutputReadsBack) {
  std::string camera = read_text(options_.camera);
  camera.replace(camera.find("shutter"), 0, "prnu: 0.01, ");
  write_atomic(options_.camera, camera);
  options_.frames = 3;
  options_.render.sensor.bayer = Bayer::gbrg;
  options_.render.sensor.prnu = true;
  options_.render.output = {.frames = FrameFormat::jpeg,
                            .jpeg_quality = 70,
                            .adc = true,
                            .mosaic = true,
                            .radiance = true,
                            .paired = true};
  run("a");
  options_.render.output = {};
  run("png");
  options_.render.sensor = {.noise = false};
  run("clean");
  const DatasetLayout a{root_ / "a"}, png{root_ / "png"}, clean{root_ / "clean"};
  EXPECT_EQ(check_dataset(root_ / "a").problems, std::vector<std::string>{});
  const Observations seen = Observations::open(root_ / "a");
  EXPECT_EQ(seen.file(1).filename(), "000001.jpg");
  EXPECT_FALSE(fs::exists(a.png_frame(1)));
  const ImageFiles named = read_info(a.info()).images;
  EXPECT_TRUE(named.jpeg && named.adc && named.mosaic && named.radiance && named.clean);
  // JPEG at quality 70 keeps this noisy frame to a few values in 255
  const cv::Mat frame = read_image_bgr(png.frame(1));
  EXPECT_LT(cv::norm(seen.image(1), frame, cv::NORM_L1) / (3.0 * frame.total()), 8.0);
  EXPECT_GT(cv::norm(seen.image(1), frame, cv::NORM_L1), 0.0);
  // the frame is the displayed picture of the demosaiced numbers
  const cv::Mat mosaic = read_image_as_stored(a.mosaic(1)), adc = read_image_as_stored(a.adc(1));
  ASSERT_EQ(mosaic.type(), CV_16UC1);
  ASSERT_EQ(adc.type(), CV_16UC3);
  EXPECT_EQ(cv::norm(demosaic(mosaic, Bayer::gbrg), adc, cv::NORM_INF), 0.0);
  const DisplayTable table(Tone::srgb, 0, 1023);
  const cv::Mat radiance = read_any_exr(a.radiance(1));
  ASSERT_EQ(radiance.type(), CV_32FC3);
  const cv::Mat paired = read_image_bgr(a.clean(1));
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x)
      for (int c = 0; c < 3; ++c) {
        ASSERT_EQ(frame.at<cv::Vec3b>(y, x)[c], table(2 - c, adc.at<cv::Vec3w>(y, x)[c]));
        const double light = radiance.at<cv::Vec3f>(y, x)[2 - c];
        // 8 bits of the light itself, to a step of the converter and one of the display
        ASSERT_NEAR(paired.at<cv::Vec3b>(y, x)[c], 255.0 * display_value(Tone::srgb, light), 4.0);
      }
  EXPECT_EQ(read_text(a.clean(1)), read_text(clean.frame(1)));
  EXPECT_EQ(read_text(a.depth(1)), read_text(clean.depth(1)));
}

TEST_F(Simulate, OnlyFrameIsThatFrameOfTheWholeRun) {
  run("whole");
  options_.only_frame = 4;
  EXPECT_EQ(run("alone").frames, 1);
  const DatasetLayout whole{root_ / "whole"}, alone{root_ / "alone"};
  EXPECT_EQ(read_text(whole.frame(4)), read_text(alone.frame(4)));
  EXPECT_EQ(read_text(whole.depth(4)), read_text(alone.depth(4)));
  EXPECT_EQ(read_text(whole.flow(4)), read_text(alone.flow(4)));
  EXPECT_FALSE(fs::exists(alone.frame(3)));
  EXPECT_FALSE(fs::exists(alone.manifest()));
  run("whole");  // of a finished dataset: nothing else is left there
  EXPECT_EQ(check_dataset(root_ / "whole").problems, std::vector<std::string>{});
}

// The first frames are those of the whole. In the last of them the camera goes on as in the whole
// while its rows are read, and says so; a wall that moves stands still from then on, since no file
// says where it would be next.
TEST_F(Simulate, TheFirstFramesAreThoseOfTheWhole) {
  write_atomic(root_ / "scene.yaml",
               "kind: mesh\nmesh: wall.ply\ntarget_edge_mm: 4\nwith_relief: false\n"
               "deformation: {breathing: true, breaths_per_minute: 60}\n");
  std::string camera = read_text(root_ / "camera.yaml");
  const std::string global = "shutter: global";
  camera.replace(camera.find(global), global.size(), "shutter: rolling, row_time_us: 600");
  write_atomic(root_ / "camera.yaml", camera);
  write_atomic(root_ / "path.yaml",
               "like: \"4\"\nlength_cm: 10\nclearance_mm: 5\nloops: {count: 0}\n");
  options_.frames = 8;
  run("whole");
  options_.first = 4;
  run("first");
  const DatasetLayout whole{root_ / "whole"}, first{root_ / "first"};
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(read_text(whole.row_poses(i)), read_text(first.row_poses(i))) << i;
    EXPECT_EQ(read_text(whole.wall_motion(i)), read_text(first.wall_motion(i))) << i;
    if (i == 3) break;
    EXPECT_EQ(read_text(whole.frame(i)), read_text(first.frame(i))) << i;
    EXPECT_EQ(read_text(whole.depth(i)), read_text(first.depth(i))) << i;
  }
  EXPECT_EQ(check_dataset(root_ / "first").problems, std::vector<std::string>{});
}

TEST_F(Simulate, TheFirstViewsOfABoard) {
  options_.scene = options_.trajectory = "chessboard";
  options_.first = 3;
  EXPECT_EQ(run("board").frames, 3);
  EXPECT_EQ(Truth::open(root_ / "board").size(), 3);
}

// What lies beside or behind the camera has a depth of 0 or less along its axis.
TEST_F(Simulate, AFisheyeSeesBeyondARightAngle) {
  write_atomic(root_ / "camera.yaml",
               "name: wide\nframes_in_paper: 6\n"
               "lens: {model: kannala_brandt, width: 64, height: 64, horizontal_fov_deg: 140}\n"
               "sensor: {pixel_pitch_um: 3, fps: 30, bit_depth: 10, full_well_e: 9000, "
               "read_noise_e: 5, shutter: global}\n");
  options_.render.truth.labels.range = true;
  run("wide");
  EXPECT_EQ(check_dataset(root_ / "wide").problems, std::vector<std::string>{});
  const Truth truth = Truth::open(root_ / "wide");
  const cv::Mat depth = truth.depth_mm(0), range = truth.label("range", 0);
  EXPECT_LT(depth.at<float>(0, 0), 0.0f);
  EXPECT_GT(range.at<float>(0, 0), 0.0f);
  EXPECT_GT(depth.at<float>(32, 32), 0.0f);
}

TEST_F(Simulate, SwitchesActAlone) {
  options_.frames = 2;
  run("noisy");
  options_.render.sensor.noise = false;
  run("clean");
  options_.render.lens.vignetting = false;
  run("flat");
  options_.render.labels = false;
  run("bare");
  const DatasetLayout noisy{root_ / "noisy"}, clean{root_ / "clean"}, flat{root_ / "flat"},
      bare{root_ / "bare"};
  EXPECT_NE(read_text(noisy.frame(0)), read_text(clean.frame(0)));
  EXPECT_NE(read_text(clean.frame(0)), read_text(flat.frame(0)));
  EXPECT_EQ(read_text(flat.frame(0)), read_text(bare.frame(0)));
  EXPECT_EQ(read_text(noisy.depth(0)), read_text(flat.depth(0)));
  EXPECT_FALSE(fs::exists(bare.depth(0)));
}

TEST_F(Simulate, SeedsChangeTheNoise) {
  options_.frames = 2;
  run("one");
  options_.seed = 2;
  run("two");
  EXPECT_NE(read_text(DatasetLayout{root_ / "one"}.frame(0)),
            read_text(DatasetLayout{root_ / "two"}.frame(0)));
}

TEST_F(Simulate, SaysWhatIsWrong) {
  const auto text_of = [&](const SimulateOptions& options, const fs::path& out) {
    Progress progress(Progress::Output::silent);
    try {
      simulate(options, out, progress);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("nothing");
  };
  SimulateOptions options = options_;
  options.frames = 1;
  EXPECT_EQ(text_of(options, root_ / "x"), "frames is 1, expected at least 2");
  options = options_;
  options.only_frame = 7;
  EXPECT_EQ(text_of(options, root_ / "y"), "only-frame is 7, but there are 7 frames");
  options = options_;
  options.threads = -1;
  EXPECT_EQ(text_of(options, root_ / "x"), "threads is -1, expected at least 0");
  options = options_;
  options.camera = "misumi-v550";
  EXPECT_TRUE(text_of(options, root_ / "x")
                  .starts_with("camera 'misumi-v550': no such preset; did you mean "
                               "'misumi-v5506'?"));
  EXPECT_FALSE(fs::exists(root_ / "x"));  // nothing is begun that cannot be finished
  options = options_;
  options.render.lens = {.samples = 4, .defocus = true};
  EXPECT_EQ(text_of(options, root_ / "x"),
            "camera 'small' has no focus (f_number and distance_mm), which lens.defocus needs");
  options = options_;
  options.trajectory = "1";
  std::string camera = read_text(root_ / "camera.yaml");
  camera.replace(camera.find("frames_in_paper: 6"), 18, "frames_in_paper: 0");
  write_atomic(root_ / "unnumbered.yaml", camera);
  options.camera = (root_ / "unnumbered.yaml").string();
  EXPECT_EQ(
      text_of(options, root_ / "x"),
      "camera 'small' has frames_in_paper: 0, which leaves 0 for this trajectory, expected at "
      "least 2; give their number (--frames)");
  options.frames = 2;  // a housing that does not fit
  camera.replace(camera.find("diameter_mm: 4"), 14, "diameter_mm: 150");
  write_atomic(root_ / "unnumbered.yaml", camera);
  EXPECT_NE(text_of(options, root_ / "x").find("a clearance of 75 mm"), std::string::npos)
      << text_of(options, root_ / "x");
  // A file stands where the folder should be.
  write_atomic(root_ / "taken", "");
  EXPECT_NE(text_of(options_, root_ / "taken").find("taken"), std::string::npos);
  // Another dataset is there already.
  run("a");
  options = options_;
  options.seed = 2;
  EXPECT_NE(text_of(options, root_ / "a").find("holds another dataset (seed is 1, now 2)"),
            std::string::npos);
}

}  // namespace
}  // namespace rugae
