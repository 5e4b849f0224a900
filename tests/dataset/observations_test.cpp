#include "dataset/observations.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <opencv2/core.hpp>

#include "core/files.h"
#include "dataset/image_io.h"
#include "tests/dataset/plane_dataset.h"

namespace rugae {
namespace {
namespace fs = std::filesystem;
using testing::error_of;
using testing::PlaneWorld;
using testing::TemporaryFolder;

// Images named 1 to `count` without leading zeros, each of one gray that tells its number.
void write_images(const fs::path& folder, int count, const char* extension = ".png",
                  cv::Size size = {64, 48}) {
  fs::create_directories(folder);
  for (int i = 1; i <= count; ++i)
    write_image(folder / ("frame" + std::to_string(i) + extension),
                cv::Mat(size, CV_8UC3, cv::Scalar::all(10 * i)));
}

fs::path write_calibration(const fs::path& folder) {
  const fs::path file = folder / "lens.yaml";
  write_atomic(file, lens_yaml(PlaneWorld().camera.lens, "test"));
  return file;
}

TEST(Observations, NaturalOrder) {
  EXPECT_TRUE(natural_less("f2.png", "f10.png"));
  EXPECT_FALSE(natural_less("f10.png", "f2.png"));
  EXPECT_TRUE(natural_less("f02.png", "f10.png"));
  EXPECT_TRUE(natural_less("a2b9", "a2b10"));
  EXPECT_TRUE(natural_less("f", "f1"));
  EXPECT_TRUE(natural_less("f01", "f1"));
  EXPECT_FALSE(natural_less("f1", "f1"));
  EXPECT_TRUE(natural_less("f99999999999999999998", "f99999999999999999999"));
}

// A strict total order, as sorting needs: exactly one of a < b, b < a, a == b; and transitive.
RC_GTEST_PROP(Observations, NaturalOrderIsAnOrder, ()) {
  const auto name = [] {
    return *rc::gen::container<std::string>(rc::gen::element('a', 'b', '0', '1', '9', '.'));
  };
  const std::string a = name(), b = name(), c = name();
  RC_ASSERT(natural_less(a, b) + natural_less(b, a) + (a == b) == 1);
  if (natural_less(a, b) && natural_less(b, c)) RC_ASSERT(natural_less(a, c));
}

TEST(Observations, OfADatasetAndOfItsObservationsFolder) {
  const TemporaryFolder folder("obs_dataset");
  const PlaneWorld world;
  world.write(folder.path() / "plane");
  for (const fs::path& path : {folder.path() / "plane", folder.path() / "plane" / "observations"}) {
    const Observations observations = Observations::open(path);
    ASSERT_EQ(observations.size(), 5);
    EXPECT_EQ(observations.name(), path.filename().string());
    EXPECT_EQ(observations.time_s(3), world.track[3].time_s);
    EXPECT_EQ(observations.lens().fx, world.camera.lens.fx);
    EXPECT_EQ(observations.lens().p2, world.camera.lens.p2);
    EXPECT_EQ(cv::norm(observations.image(3), world.image(3), cv::NORM_INF), 0.0);
  }
}

TEST(Observations, TruthIsNotNeeded) {
  const TemporaryFolder folder("obs_no_truth");
  PlaneWorld().write(folder.path() / "plane");
  fs::remove_all(folder.path() / "plane" / "truth");
  EXPECT_EQ(Observations::open(folder.path() / "plane").size(), 5);
}

TEST(Observations, OfAPlainFolderInNaturalOrder) {
  const TemporaryFolder folder("obs_plain");
  write_images(folder.path() / "images", 12);
  write_atomic(folder.path() / "images" / "notes.txt", "not an image");
  const auto calibration = write_calibration(folder.path());
  const auto observations = Observations::open(folder.path() / "images", calibration, 25.0);
  ASSERT_EQ(observations.size(), 12);
  EXPECT_DOUBLE_EQ(observations.time_s(5), 0.2);
  for (int i = 0; i < 12; ++i)
    EXPECT_EQ(observations.image(i).at<cv::Vec3b>(0, 0)[0], 10 * (i + 1)) << i;
}

TEST(Observations, ACalibrationGivenOverridesTheDatasets) {
  const TemporaryFolder folder("obs_override");
  const PlaneWorld world;
  world.write(folder.path() / "plane");
  Lens lens = world.camera.lens;
  lens.fx = 43.0;
  write_atomic(folder.path() / "lens.yaml", lens_yaml(lens, ""));
  EXPECT_EQ(Observations::open(folder.path() / "plane", folder.path() / "lens.yaml").lens().fx,
            43.0);
}

// How long rows take is the sensor's, not the lens': a lens calibrated anew does not lose it.
TEST(Observations, TheTimeOfARowIsTheFilesThatSaysIt) {
  const TemporaryFolder folder("obs_rows");
  const fs::path images = folder.path() / "images", lens = folder.path() / "lens.yaml";
  write_images(images, 3);
  const Lens plain = PlaneWorld().camera.lens;  // 48 rows
  const auto row_time_us = [&] {
    return 1e6 * Observations::open(images, lens, 25.0).row_time_s();
  };
  write_atomic(lens, lens_yaml(plain, ""));
  EXPECT_EQ(row_time_us(), 0.0);
  write_atomic(images / "calibration.yaml", calibration_yaml({plain, 250.0, {}}, ""));
  EXPECT_DOUBLE_EQ(row_time_us(), 250.0);
  EXPECT_DOUBLE_EQ(1e6 * Observations::open(images, {}, 25.0).row_time_s(), 250.0);
  write_atomic(lens, calibration_yaml({plain, 500.0, {}}, ""));
  EXPECT_DOUBLE_EQ(row_time_us(), 500.0);
  write_atomic(lens, lens_yaml(plain, "") + "row_time_us: 0\n");
  EXPECT_EQ(row_time_us(), 0.0);

  write_atomic(lens, calibration_yaml({plain, 900.0, {}}, ""));
  EXPECT_EQ(error_of(row_time_us), lens.string() +
                                       ": row_time_us is 900, 48 rows take 0.0432 s, but frames "
                                       "are 0.04 s apart");
  write_atomic(lens, "row_time_us: -1\n" + lens_yaml(plain, ""));
  EXPECT_EQ(error_of(row_time_us),
            lens.string() + ":1:14: row_time_us is -1, expected 0 (a global shutter) or above");
}

TEST(Observations, LightsAreTheFilesThatSaysWhereTheyAre) {
  const TemporaryFolder folder("obs_lights");
  const fs::path images = folder.path() / "images", lens = folder.path() / "lens.yaml";
  write_images(images, 3);
  const Lens plain = PlaneWorld().camera.lens;
  write_atomic(lens, lens_yaml(plain, ""));
  EXPECT_TRUE(Observations::open(images, lens).lights().empty());
  const Emitter beside{Vec3(3.0, -1.0, 0.5), Vec3(0.0, 0.6, 0.8), 2.5, 0.7};
  write_atomic(images / "calibration.yaml",
               calibration_yaml({plain, {}, std::vector<Emitter>{beside}}, ""));
  const auto lights = Observations::open(images, lens).lights();
  ASSERT_EQ(lights.size(), 1u);
  EXPECT_EQ(lights[0].offset_mm, beside.offset_mm);
  EXPECT_LE((lights[0].axis - beside.axis).norm(), 1e-15);
  EXPECT_EQ(lights[0].lobe, beside.lobe);
  EXPECT_EQ(lights[0].intensity, beside.intensity);
}

// What is recorded frame by frame reads back as it was given, also by others while it grows.
TEST(Observations, RecordedFramesAreObservations) {
  const TemporaryFolder folder("obs_record");
  const fs::path root = folder.path() / "live";
  const Calibration calibration{PlaneWorld().camera.lens, 250.0, {}};  // 48 rows: 12 ms
  Observations live = Observations::record(root, calibration);
  EXPECT_EQ(live.size(), 0);
  const cv::Mat first(48, 64, CV_8UC3, cv::Scalar(1, 2, 3)), second = 2 * first;
  live.append(first, 0.5);
  live.append(second, 0.75);
  const Observations read = Observations::open(root);
  EXPECT_EQ(read.times_s(), (std::vector<double>{0.5, 0.75}));
  EXPECT_EQ(read.name(), "live");
  EXPECT_DOUBLE_EQ(read.row_time_s(), 250e-6);
  EXPECT_EQ(read.lens().fx, calibration.lens.fx);
  for (const Observations& each : {live, read}) {
    EXPECT_EQ(cv::norm(each.image(0), first, cv::NORM_INF), 0.0);
    EXPECT_EQ(cv::norm(each.image(1), second, cv::NORM_INF), 0.0);
  }
  EXPECT_EQ(
      error_of([&] { live.append(first, 0.76); }),
      root.string() + ": row_time_us is 250, 48 rows take 0.012 s, but frames are 0.01 s apart");
  EXPECT_EQ(error_of([&] { live.append(first, std::nan("")); }),
            root.string() + ": frame 2 is at nan s, expected after 0.75 s");
  EXPECT_EQ(error_of([&] { live.append(cv::Mat(48, 64, CV_8U), 1.0); }),
            root.string() + ": frame 2 is 64 x 48 px of type 0, expected 64 x 48 px, 8-bit BGR");
  EXPECT_EQ(live.size(), 2);
  EXPECT_EQ(error_of([&] { Observations::record(root, calibration); }),
            root.string() + ": has frames already, expected a folder to record into");
  Observations opened = read;
  EXPECT_EQ(error_of([&] { opened.append(first, 1.0); }), "live: is not being recorded");
}

TEST(Observations, WhatIsMissingIsNamed) {
  const TemporaryFolder folder("obs_errors");
  const auto calibration = write_calibration(folder.path());
  const auto open_error = [&](const fs::path& path, const fs::path& lens) {
    return error_of([&] { Observations::open(path, lens); });
  };
  const fs::path none = folder.path() / "none";
  EXPECT_EQ(open_error(none, calibration), none.string() + ": no such folder");
  EXPECT_EQ(open_error(calibration, calibration),
            calibration.string() + ": is a file, expected a folder");

  const fs::path empty = folder.path() / "empty";
  fs::create_directories(empty);
  EXPECT_EQ(open_error(empty, calibration),
            empty.string() + ": no images (PNG, JPEG or BMP) in this folder");

  const fs::path one = folder.path() / "one";
  write_images(one, 1);
  EXPECT_EQ(open_error(one, calibration),
            one.string() + ": 1 usable frame, at least two are needed");

  const fs::path two = folder.path() / "two";
  write_images(two, 2);
  EXPECT_EQ(open_error(two, {}),
            two.string() + ": no calibration for these images; give one with --calibration");
  EXPECT_EQ(open_error(two, folder.path() / "other.yaml"),
            (folder.path() / "other.yaml").string() + ": no such file");

  const fs::path large = folder.path() / "large";
  write_images(large, 2, ".jpg", {80, 48});
  EXPECT_EQ(
      open_error(large, calibration),
      (large / "frame1.jpg").string() + ": image of 80 x 48 px, the calibration is for 64 x 48");
}

TEST(Observations, ALaterImageOfAnotherSizeIsNamedWhenRead) {
  const TemporaryFolder folder("obs_size");
  write_images(folder.path() / "images", 3);
  write_image(folder.path() / "images" / "frame3.png", cv::Mat(48, 63, CV_8UC3, cv::Scalar()));
  const auto observations =
      Observations::open(folder.path() / "images", write_calibration(folder.path()));
  EXPECT_EQ(error_of([&] { observations.image(2); }),
            (folder.path() / "images" / "frame3.png").string() +
                ": image of 63 x 48 px, the calibration is for 64 x 48");
}

TEST(Observations, AnUnfinishedDatasetIsRefused) {
  const TemporaryFolder folder("obs_unfinished");
  const fs::path root = folder.path() / "plane";
  PlaneWorld().write(root);
  fs::remove(root / "observations" / "frames.csv");
  EXPECT_EQ(error_of([&] { Observations::open(root); }),
            root.string() +
                ": the dataset was not finished (no observations/frames.csv); run the simulation "
                "again");
}

TEST(Observations, OneFrameOfADatasetIsTooFew) {
  const TemporaryFolder folder("obs_one");
  PlaneWorld(1).write(folder.path() / "plane");
  EXPECT_EQ(error_of([&] { Observations::open(folder.path() / "plane"); }),
            (folder.path() / "plane").string() + ": 1 usable frame, at least two are needed");
}

}  // namespace
}  // namespace rugae
