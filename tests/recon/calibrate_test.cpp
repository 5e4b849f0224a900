#include "recon/calibrate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "core/check.h"
#include "core/random.h"
#include "dataset/image_io.h"
#include "recon/chessboard.h"
#include "synthetic_texture.h"
#include "tests/dataset/plane_dataset.h"
#include "tests/shared_data.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;
constexpr int kColumns = 7, kRows = 6;
constexpr double kSquareMm = 2.0;

Lens endoscope(LensModel model) {
  Lens lens;
  lens.model = model;
  lens.width = 640;
  lens.height = 480;
  lens.fx = 271.0;
  lens.fy = 269.5;
  lens.cx = 322.3;
  lens.cy = 238.1;
  lens.k1 = model == LensModel::brown_conrady ? -0.2 : 0.05;
  lens.k2 = model == LensModel::brown_conrady ? 0.03 : -0.01;
  return lens;
}

Lens smaller(Lens lens, double times) {
  lens.width = static_cast<int>(lens.width * times);
  lens.height = static_cast<int>(lens.height * times);
  for (double* length : {&lens.fx, &lens.fy, &lens.cx, &lens.cy}) *length *= times;
  return lens;
}

// Boards at various tilts in front of the lens, each wholly in view.
std::vector<Rigid3> board_poses(int count) {
  std::vector<Rigid3> poses;
  for (int i = 0; i < count; ++i) {
    const auto u = random_uniform(1, Purpose::test, 1, static_cast<std::uint64_t>(i));
    const Quat turn = Quat(Eigen::AngleAxisd(0.9 * (u[0] - 0.5), Vec3::UnitX())) *
                      Quat(Eigen::AngleAxisd(1.2 * (u[1] - 0.5), Vec3::UnitY())) *
                      Quat(Eigen::AngleAxisd(2.0 * (u[2] - 0.5), Vec3::UnitZ()));
    const Vec3 middle(0.5 * (kColumns - 1) * kSquareMm, 0.5 * (kRows - 1) * kSquareMm, 0.0);
    const Vec3 at(5.0 * (u[3] - 0.5), 5.0 * (u[0] - 0.5), 15.0 + 6.0 * u[1]);
    poses.emplace_back(turn, at - turn * middle);
  }
  return poses;
}

CalibrationImage exact_view(const Lens& lens, const Rigid3& cam_from_board) {
  CalibrationImage image;
  image.used = true;
  image.board.columns = kColumns;
  image.board.rows = kRows;
  for (int i = 0; i < kColumns * kRows; ++i) {
    const Vec3 p(i % kColumns * kSquareMm, i / kColumns * kSquareMm, 0.0);
    image.board.corners_px.push_back(lens.project(cam_from_board * p).value());
  }
  return image;
}

std::vector<CalibrationImage> exact_views(const Lens& lens, int count) {
  std::vector<CalibrationImage> views;
  for (const Rigid3& pose : board_poses(count)) views.push_back(exact_view(lens, pose));
  return views;
}

// The board as the lens sees it, white margin included; 3 x 3 rays a pixel.
cv::Mat picture(const Lens& lens, const Rigid3& cam_from_board, bool mirrored) {
  const Rigid3 board_from_cam = cam_from_board.inverse();
  const LensProjector projector(lens);
  const auto shade = [&](const Vec2& pixel) {
    double sum = 0.0;
    for (int s = 0; s < 9; ++s) {
      const auto ray = projector.unproject(pixel + Vec2(s % 3 - 1, s / 3 - 1) / 3.0);
      const Vec3 o = board_from_cam.translation, d = board_from_cam.rotation * *ray;
      const Vec3 hit = (o - d * (o.z() / d.z())) / kSquareMm;
      const bool inside = hit.x() > -1 && hit.y() > -1 && hit.x() < kColumns && hit.y() < kRows;
      const int parity =
          static_cast<int>(std::floor(hit.x())) + static_cast<int>(std::floor(hit.y()));
      sum += inside && parity % 2 == 0 ? 0.1 : 0.8;
    }
    return sum / 9.0;
  };
  return testing::to_8bit(testing::draw(lens.width, lens.height, [&](const Vec2& p) {
    return shade(mirrored ? Vec2(lens.width - p.x(), p.y()) : p);
  }));
}

void expect_lens(const Lens& found, const Lens& truth, double tolerance_px, double tolerance_k) {
  EXPECT_EQ(found.model, truth.model);
  EXPECT_NEAR(found.fx, truth.fx, tolerance_px);
  EXPECT_NEAR(found.fy, truth.fy, tolerance_px);
  EXPECT_NEAR(found.cx, truth.cx, tolerance_px);
  EXPECT_NEAR(found.cy, truth.cy, tolerance_px);
  EXPECT_NEAR(found.k1, truth.k1, tolerance_k);
  EXPECT_NEAR(found.k2, truth.k2, tolerance_k);
}

TEST(Calibrate, ExactCornersGiveBackTheLens) {
  for (const LensModel model : {LensModel::brown_conrady, LensModel::kannala_brandt}) {
    const Lens truth = endoscope(model);
    CalibrationOptions options;
    options.square_mm = kSquareMm;
    options.model = model;
    const CalibrationResult result =
        calibrate_boards(exact_views(truth, 12), truth.width, truth.height, options);
    EXPECT_EQ(result.used, 12);
    // Corners pass through OpenCV as floats: 3e-5 px.
    EXPECT_TRUE(result.rms_px <= 1e-3) << result.rms_px;
    expect_lens(result.lens, truth, 0.01, 1e-3);
    const Rigid3 pose = board_poses(12)[4];
    EXPECT_TRUE((result.images[4].cam_from_board.translation - pose.translation).norm() <= 0.01);
  }
}

TEST(Calibrate, ChoosesTheModelThatFits) {
  const Lens truth = endoscope(LensModel::kannala_brandt);
  CalibrationOptions options;
  options.square_mm = kSquareMm;
  const CalibrationResult result =
      calibrate_boards(exact_views(truth, 12), truth.width, truth.height, options);
  EXPECT_EQ(result.lens.model, LensModel::kannala_brandt);
  EXPECT_GE(result.trials.size(), 4u);
}

TEST(Calibrate, RejectsAPictureThatDisagrees) {
  const Lens truth = endoscope(LensModel::brown_conrady);
  std::vector<CalibrationImage> views = exact_views(truth, 10);
  for (int i = 0; i < kColumns; ++i)
    views[3].board.corners_px[static_cast<std::size_t>(i)].x() += 9;
  CalibrationOptions options;
  options.square_mm = kSquareMm;
  options.model = LensModel::brown_conrady;
  const CalibrationResult result =
      calibrate_boards(std::move(views), truth.width, truth.height, options);
  EXPECT_EQ(result.used, 9);
  EXPECT_FALSE(result.images[3].used);
  EXPECT_NE(result.images[3].reason.find("re-projection error"), std::string::npos);
  expect_lens(result.lens, truth, 0.01, 1e-3);
}

TEST(Calibrate, FindsDrawnBoardsMirroredOrNot) {
  const Lens lens = endoscope(LensModel::brown_conrady);
  const Rigid3 pose = board_poses(1)[0];
  const BoardView truth = exact_view(lens, pose).board;
  for (const bool mirrored : {false, true}) {
    const cv::Mat gray = picture(lens, pose, mirrored);
    const auto board = find_board(gray, kColumns, kRows);
    ASSERT_TRUE(board);
    ASSERT_EQ(board->corners_px.size(), truth.corners_px.size());
    const Vec2 right = board->corners_px[kColumns - 1] - board->corners_px[0];
    const Vec2 down = board->corners_px[kColumns] - board->corners_px[0];
    EXPECT_GT(right.x() * down.y() - right.y() * down.x(), 0.0);
    for (const Vec2& p : board->corners_px) {
      const Vec2 seen = mirrored ? Vec2(lens.width - p.x(), p.y()) : p;
      double nearest = 1e9;
      for (const Vec2& q : truth.corners_px) nearest = std::min(nearest, (q - seen).norm());
      EXPECT_TRUE(nearest <= 0.15) << nearest;  // of edges drawn with 3 x 3 rays
    }
    if (!mirrored) {
      EXPECT_EQ(find_board_size(gray), std::make_pair(kColumns, kRows));
    }
  }
}

// A hand covers part of the board in one of the pictures that are asked for its size.
TEST(Calibrate, TheSizeIsThatOfTheWholeBoard) {
  const testing::TemporaryFolder folder("board_size");
  const Lens lens = smaller(endoscope(LensModel::brown_conrady), 0.5);  // soon drawn
  const std::vector<Rigid3> poses = board_poses(13);
  std::vector<fs::path> pictures;
  constexpr std::size_t kCovered = 4;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    cv::Mat gray = picture(lens, poses[i], false);
    if (i == kCovered) {
      const BoardView board = exact_view(lens, poses[i]).board;
      std::vector<cv::Point> hand;
      for (const int corner : {4, kColumns - 1, kColumns * kRows - 1, kColumns * (kRows - 1) + 4}) {
        const Vec2& at = board.corners_px[static_cast<std::size_t>(corner)];
        hand.emplace_back(static_cast<int>(at.x()), static_cast<int>(at.y()));
      }
      cv::fillConvexPoly(gray, hand, cv::Scalar(200));
    }
    pictures.push_back(folder.path() / fmt::format("{:06d}.png", i));
    write_image(pictures.back(), gray);
  }
  CalibrationOptions options;
  options.square_mm = kSquareMm;
  const CalibrationResult result = calibrate(pictures, options);
  EXPECT_EQ(result.columns, kColumns);
  EXPECT_EQ(result.rows, kRows);
  EXPECT_EQ(result.used, static_cast<int>(poses.size()) - 1);
  expect_lens(result.lens, lens, 0.5, 0.01);
}

// Small, dark and noisy: of these two pictures the finder of dark squares leaves corners where none
// could be fitted, up to a pixel off. Those of saddle points are fitted to a quarter of one.
TEST(Calibrate, NoCornerStaysWhereTheQuickFinderPutIt) {
  constexpr double kShrink = 0.4, kLight = 0.3, kNoise = 9.0, kOff_px = 0.5;
  const Lens lens = smaller(endoscope(LensModel::brown_conrady), kShrink);
  cv::Mat noise(lens.height, lens.width, CV_32F);
  cv::RNG(7).fill(noise, cv::RNG::NORMAL, 0.0, kNoise);
  for (const std::size_t i : {9u, 11u}) {
    const Rigid3 pose = board_poses(12)[i];
    cv::Mat gray = picture(lens, pose, false), light;
    gray.convertTo(light, CV_32F, kLight);
    cv::Mat(light + noise).convertTo(gray, CV_8U);
    const auto board = find_board(gray, kColumns, kRows);
    ASSERT_TRUE(board);
    for (const Vec2& q : exact_view(lens, pose).board.corners_px) {
      double nearest_px = 1e9;
      for (const Vec2& p : board->corners_px) nearest_px = std::min(nearest_px, (q - p).norm());
      EXPECT_TRUE(nearest_px <= kOff_px) << i << ": " << nearest_px;
    }
  }
}

TEST(Calibrate, SaysWhatIsWrong) {
  const auto message = [](const auto& run) {
    try {
      run();
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(message([] { pictures_in("/no/such/folder"); }),
            "/no/such/folder: no such file or folder");
  EXPECT_EQ(message([] { calibrate_boards(std::vector<CalibrationImage>(4), 640, 480, {}); }),
            "calibration: the board was found in 0 of 4 pictures, expected at least 3");
  CalibrationOptions options;
  options.columns = 7;
  EXPECT_EQ(message([&] { options.check(); }),
            "calibration: the board is 7 x 0 inner corners, expected at least 3 x 3, or 0 x 0 to "
            "search for it");
}

// Corners and lenses as published with the pictures.
std::map<std::string, double> published(const fs::path& folder) {
  std::map<std::string, double> values;
  std::ifstream file(folder / "intrinsics.txt");
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string key;
    double value = 0.0;
    if (words >> key >> value) values[key] = value;
  }
  return values;
}

std::vector<CalibrationImage> published_boards(const fs::path& folder) {
  std::map<std::string, CalibrationImage> images;
  std::ifstream file(folder / "corners.csv");
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#' || line.rfind("image,", 0) == 0) continue;
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream words(line);
    std::string name;
    double corner, x, y, u, v;
    words >> name >> corner >> x >> y >> u >> v;
    CalibrationImage& image = images[name];
    image.used = true;
    image.file = name;
    image.board.corners_px.emplace_back(u + 0.5, v + 0.5);
    if (x == 0.0) ++image.board.columns;
  }
  std::vector<CalibrationImage> result;
  for (auto& [name, image] : images) {
    image.board.rows = static_cast<int>(image.board.corners_px.size()) / image.board.columns;
    result.push_back(image);
  }
  return result;
}

Lens published_lens(std::map<std::string, double>& values) {
  Lens lens;
  lens.width = static_cast<int>(values["image_width"]);
  lens.height = static_cast<int>(values["image_height"]);
  lens.fx = values["pinhole_fx"];
  lens.fy = values["pinhole_fy"];
  lens.cx = values["pinhole_cx"] + 0.5;
  lens.cy = values["pinhole_cy"] + 0.5;
  lens.k1 = values["pinhole_k1"];
  lens.k2 = values["pinhole_k2"];
  return lens;
}

// Mean re-projection error of the corners through `lens`, each board at the pose that suits the
// lens best.
double mean_error_px(const Lens& lens, const std::vector<CalibrationImage>& boards) {
  double sum_px = 0.0;
  int count = 0;
  for (const CalibrationImage& image : boards) {
    std::vector<cv::Point3d> board;
    std::vector<cv::Point2d> rays;  // on the plane z = 1
    std::vector<Vec2> pixels;
    for (std::size_t i = 0; i < image.board.corners_px.size(); ++i) {
      const int k = static_cast<int>(i);
      const auto ray = lens.unproject(image.board.corners_px[i]);
      if (!ray) continue;
      board.emplace_back(k % image.board.columns * kSquareMm, k / image.board.columns * kSquareMm,
                         0.0);
      rays.emplace_back(ray->x() / ray->z(), ray->y() / ray->z());
      pixels.push_back(image.board.corners_px[i]);
    }
    cv::Vec3d turn, shift;
    if (!cv::solvePnP(board, rays, cv::Matx33d::eye(), cv::noArray(), turn, shift))
      return std::nan("");
    cv::Matx33d rotation;
    cv::Rodrigues(turn, rotation);
    for (std::size_t i = 0; i < board.size(); ++i) {
      const cv::Vec3d p = rotation * cv::Vec3d(board[i].x, board[i].y, board[i].z) + shift;
      const auto seen = lens.project({p[0], p[1], p[2]});
      if (!seen) return std::nan("");
      sum_px += (*seen - pixels[i]).norm();
      ++count;
    }
  }
  return sum_px / count;
}

// From each corner that we found to the nearest published one of the same picture.
double median_disagreement_px(const std::vector<CalibrationImage>& found,
                              const std::vector<CalibrationImage>& boards) {
  std::vector<double> distances_px;
  for (const CalibrationImage& image : found) {
    for (const CalibrationImage& board : boards) {
      if (!image.used || board.file != image.file.filename()) continue;
      for (const Vec2& p : image.board.corners_px) {
        double nearest_px = 1e9;
        for (const Vec2& q : board.board.corners_px)
          nearest_px = std::min(nearest_px, (p - q).norm());
        distances_px.push_back(nearest_px);
      }
    }
  }
  if (distances_px.empty()) return std::nan("");
  const auto middle = distances_px.begin() + static_cast<std::ptrdiff_t>(distances_px.size() / 2);
  std::nth_element(distances_px.begin(), middle, distances_px.end());
  return *middle;
}

class RealDataCalibration : public ::testing::TestWithParam<const char*> {};

TEST_P(RealDataCalibration, PublishedCornersGiveThePublishedLens) {
  const fs::path folder = shared_data() / "calibration" / GetParam();
  if (!fs::exists(folder)) GTEST_SKIP() << folder << " is not here";
  auto values = published(folder);
  CalibrationOptions options;
  options.square_mm = kSquareMm;
  options.max_image_error_px = 100.0;  // the published lens uses every picture
  const int width = static_cast<int>(values["image_width"]);
  const CalibrationResult result =
      calibrate_boards(published_boards(folder), width, width, options);
  ASSERT_FALSE(result.trials.empty());
  const Lens& lens = result.trials[0].lens;  // k1 k2 alone, as published
  // The same least squares by another program: what is left is where each stopped.
  EXPECT_NEAR(lens.fx, values["pinhole_fx"], 0.1);
  EXPECT_NEAR(lens.fy, values["pinhole_fy"], 0.1);
  EXPECT_NEAR(lens.cx - 0.5, values["pinhole_cx"], 0.1);
  EXPECT_NEAR(lens.cy - 0.5, values["pinhole_cy"], 0.1);
  EXPECT_NEAR(lens.k1, values["pinhole_k1"], 1e-3);
  EXPECT_NEAR(lens.k2, values["pinhole_k2"], 1e-3);
}

TEST_P(RealDataCalibration, RealPicturesBelowOnePixel) {
  const fs::path folder = shared_data() / "calibration" / GetParam();
  if (!fs::exists(folder)) GTEST_SKIP() << folder << " is not here";
  auto values = published(folder);
  CalibrationOptions options;
  options.square_mm = kSquareMm;
  options.columns = std::string(GetParam()) == "MiroCam" ? 7 : 8;
  options.rows = 6;
  const CalibrationResult result = calibrate(pictures_in(folder / "images"), options);
  std::string unused;
  for (const CalibrationImage& image : result.images)
    if (!image.used) unused += image.file.filename().string() + ": " + image.reason + "; ";
  RecordProperty("mean_px", std::to_string(result.mean_px));
  std::cout << GetParam() << ": " << result.used << " of " << result.images.size()
            << " pictures, mean " << result.mean_px << " px, rms " << result.rms_px << " px; "
            << unused << "\n";
  EXPECT_TRUE(result.mean_px < 1.0);
  // One PillCam picture has corners that saturation has washed out.
  EXPECT_GE(result.used, 9);
  // Focal length, distance and k1 trade against each other on boards that tilt little, so the two
  // lenses are compared by what they say of the published corners, with poses of their own. The
  // published lens was fitted to these very corners; ours saw corners found anew in the pictures.
  // What it may lose is therefore the disagreement between the two sets of corners.
  const std::vector<CalibrationImage> boards = published_boards(folder);
  const double published_px = mean_error_px(published_lens(values), boards);
  const double ours_px = mean_error_px(result.lens, boards);
  const double disagreement_px = median_disagreement_px(result.images, boards);
  std::cout << GetParam() << ": on the published corners " << ours_px << " px, the published lens "
            << published_px << " px; corners differ by " << disagreement_px << " px\n";
  EXPECT_TRUE(disagreement_px < 0.5);  // the same corners were found
  EXPECT_TRUE(ours_px <= published_px + disagreement_px);
}

INSTANTIATE_TEST_SUITE_P(RealData, RealDataCalibration,
                         ::testing::Values("MiroCam", "PillCam_cam1"));

}  // namespace
}  // namespace rugae
