// A rendered dataset in other programs' layouts, read back as their documentation says: points land
// where they are, depth and pose put them on the wall.

#include "dataset/export/export.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "core/check.h"
#include "core/files.h"
#include "dataset/ply_io.h"
#include "dataset/truth.h"
#include "render/simulate.h"
#include "tests/message_of.h"

namespace rugae {
namespace {
namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr int kFrames = 8;
constexpr double kSingle = 1e-4;  // mm: depth and points on disk are single precision

std::vector<std::vector<double>> numbers_in(const fs::path& file, char between = ' ') {
  std::ifstream stream(file);
  std::vector<std::vector<double>> lines;
  for (std::string line; std::getline(stream, line);) {
    if (line.starts_with('#')) continue;
    std::ranges::replace(line, between, ' ');
    std::istringstream words(line);
    lines.emplace_back();
    for (double number; words >> number;) lines.back().push_back(number);
  }
  return lines;
}

class Export : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    root_ = fs::temp_directory_path() / fmt::format("rugae_export_{}", getpid());
    fs::remove_all(root_);
    make_folder(root_);
    const std::string sensor =
        "sensor: {pixel_pitch_um: 6, fps: 30, bit_depth: 10, full_well_e: 18000, read_noise_e: 10";
    write_atomic(root_ / "polynomial.yaml",
                 "lens: {width: 160, height: 120, fx: 80, fy: 82, cx: 78.5, cy: 61, k1: -0.15, "
                 "k2: 0.02, k3: -0.001, p1: 0.002, p2: -0.001}\n" +
                     sensor + "}\n");
    write_atomic(root_ / "fisheye.yaml",
                 "lens: {model: kannala_brandt, width: 160, height: 120, fx: 60, fy: 60, cx: 80, "
                 "cy: 60, k1: -0.02, k2: 0.004, field_stop: circle, field_stop_radius: 0.95}\n" +
                     sensor + ", shutter: rolling, row_time_us: 200}\n");
    write_atomic(root_ / "path.yaml", "like: '1'\nlength_cm: 10\npasses: 1\n");
    SimulateOptions options;
    options.trajectory = (root_ / "path.yaml").string();
    options.resolution = "coarse";
    options.frames = kFrames;
    options.render.truth.labels.backward_flow = true;
    options.render.truth.tracks = 300;
    Progress progress(Progress::Output::silent);
    options.camera = (root_ / "polynomial.yaml").string();
    simulate(options, polynomial(), progress);
    options.render.truth = {};
    options.render.output.frames = FrameFormat::jpeg;
    options.camera = (root_ / "fisheye.yaml").string();
    simulate(options, fisheye(), progress);
  }
  static void TearDownTestSuite() { fs::remove_all(root_); }

  static fs::path polynomial() { return root_ / "polynomial"; }
  static fs::path fisheye() { return root_ / "fisheye"; }

  static fs::path exported(const fs::path& dataset, const ExportOptions& options) {
    const fs::path out = root_ / (dataset.filename().string() + "_" + options.format);
    fs::remove_all(out);
    Progress progress(Progress::Output::silent);
    report_ = export_dataset(dataset, options, out, progress);
    EXPECT_EQ(report_.frames, kFrames);
    return out;
  }
  static bool noted(const std::string& words) {
    return std::ranges::any_of(report_.notes, [&](const std::string& note) {
      return note.find(words) != std::string::npos;
    });
  }

  static fs::path root_;
  static ExportReport report_;
};
fs::path Export::root_;
ExportReport Export::report_;

// The model of an entry in cameras.txt by COLMAP's documentation.
Vec2 colmap_projection(const std::string& model, const std::vector<double>& p, const Vec3& p_cam) {
  const double u = p_cam.x() / p_cam.z(), v = p_cam.y() / p_cam.z(), r2 = u * u + v * v;
  if (model == "OPENCV_FISHEYE") {
    const double r = std::sqrt(r2), theta = std::atan(r), t2 = theta * theta;
    const double bent = theta * (1 + t2 * (p[4] + t2 * (p[5] + t2 * (p[6] + t2 * p[7]))));
    return {p[0] * u * bent / r + p[2], p[1] * v * bent / r + p[3]};
  }
  EXPECT_EQ(model, "FULL_OPENCV");
  const double radial =
      (1 + r2 * (p[4] + r2 * (p[5] + r2 * p[8]))) / (1 + r2 * (p[9] + r2 * (p[10] + r2 * p[11])));
  return {p[0] * (u * radial + 2 * p[6] * u * v + p[7] * (r2 + 2 * u * u)) + p[2],
          p[1] * (v * radial + 2 * p[7] * u * v + p[6] * (r2 + 2 * v * v)) + p[3]};
}

TEST_F(Export, PointsOfAColmapModelLandWhereItsImagesHaveThem) {
  const fs::path out = exported(polynomial(), {"colmap"}), sparse = out / "sparse" / "0";
  std::istringstream camera(read_text(sparse / "cameras.txt"));
  std::string line, model;
  std::getline(camera, line);
  int id = 0, width = 0, height = 0;
  camera >> id >> model >> width >> height;
  EXPECT_EQ(std::pair(width, height), std::pair(160, 120));
  std::vector<double> parameters;
  for (double p; camera >> p;) parameters.push_back(p);
  ASSERT_EQ(parameters.size(), 12u);

  std::map<int, std::vector<double>> points;
  for (const auto& point : numbers_in(sparse / "points3D.txt"))
    points[static_cast<int>(point[0])] = point;
  ASSERT_GE(points.size(), 100u);

  std::ifstream images(sparse / "images.txt");
  std::map<std::pair<int, int>, int> point_at;  // of an image's place
  constexpr double kRounding_px = 1e-4;         // barycentric coordinates are single precision
  int frames = 0;
  while (std::getline(images, line)) {
    if (line.starts_with('#')) continue;
    std::istringstream head(line);
    int image = 0, camera_id = 0;
    Quat q;
    Vec3 t;
    std::string name;
    head >> image >> q.w() >> q.x() >> q.y() >> q.z() >> t.x() >> t.y() >> t.z() >> camera_id >>
        name;
    EXPECT_EQ(camera_id, id);
    const cv::Mat bgr = cv::imread((out / "images" / name).string());
    ASSERT_EQ(bgr.cols, width);
    std::getline(images, line);
    std::istringstream places(line);
    Vec2 pixel;
    for (int point = 0, place = 0; places >> pixel.x() >> pixel.y() >> point; ++place) {
      point_at[{image, place}] = point;
      const std::vector<double>& p = points.at(point);
      const Vec2 landed = colmap_projection(model, parameters, q * Vec3(p[1], p[2], p[3]) + t);
      EXPECT_LE((landed - pixel).norm(), kRounding_px) << name << " point " << point;
      if (p[8] != image) continue;  // coloured by the first image of its track
      const auto& color =
          bgr.at<cv::Vec3b>(static_cast<int>(pixel.y()), static_cast<int>(pixel.x()));
      EXPECT_EQ(Vec3(p[4], p[5], p[6]), Vec3(color[2], color[1], color[0]));
    }
    ++frames;
  }
  EXPECT_EQ(frames, kFrames);
  std::size_t in_tracks = 0;
  for (const auto& [number, p] : points) {
    EXPECT_GE(p.size(), 8u + 2u * 2u) << "a track of one image";
    for (std::size_t i = 8; i + 1 < p.size(); i += 2, ++in_tracks)
      EXPECT_EQ(point_at.at({static_cast<int>(p[i]), static_cast<int>(p[i + 1])}), number);
  }
  EXPECT_EQ(in_tracks, point_at.size());
}

TEST_F(Export, AFisheyeWithoutTracksHasPointsOnTheWall) {
  const fs::path out = exported(fisheye(), {"colmap"}), sparse = out / "sparse" / "0";
  EXPECT_TRUE(noted("rolling"));
  EXPECT_TRUE(noted("without tracks"));
  std::istringstream camera(read_text(sparse / "cameras.txt"));
  std::string line, model;
  std::getline(camera, line);
  double number = 0.0;
  camera >> number >> model;
  std::vector<double> parameters;
  for (double p; camera >> p;) parameters.push_back(p);
  ASSERT_EQ(parameters.size(), 2u + 8u);
  parameters.erase(parameters.begin(), parameters.begin() + 2);
  const Truth truth = Truth::open(fisheye());
  const Vec3 p_cam(5.0, -9.0, 4.0);
  EXPECT_LE(
      (colmap_projection(model, parameters, p_cam) - truth.camera().lens.project(p_cam).value())
          .norm(),
      1e-9);
  const ClosestPoint wall(truth.wall());
  const auto points = numbers_in(sparse / "points3D.txt");
  ASSERT_GE(points.size(), 1000u);
  for (const auto& p : points) EXPECT_LE(wall({p[1], p[2], p[3]}).distance_mm, kSingle);
  EXPECT_TRUE(fs::exists(out / "images" / "000000.jpg"));
}

TEST_F(Export, NerfstudioDepthAndPosesPutPixelsOnTheWall) {
  const fs::path out = exported(polynomial(), {"nerfstudio"});
  const Json transforms = Json::parse(read_text(out / "transforms.json"));
  const Truth truth = Truth::open(polynomial());
  const Lens& lens = truth.camera().lens;
  EXPECT_EQ(transforms["camera_model"], "OPENCV");
  EXPECT_EQ(transforms["cx"], lens.cx);  // pixel centres at a half there, too
  EXPECT_EQ(transforms["k3"], lens.k3);
  EXPECT_EQ(transforms["p2"], lens.p2);
  ASSERT_EQ(transforms["frames"].size(), static_cast<std::size_t>(kFrames));
  ASSERT_TRUE(noted("--depth-unit-scale-factor 5e-06"));
  constexpr double kUnit_m = 5e-6, kMm = 1e3;
  const ClosestPoint wall(truth.wall());
  for (const Json& frame : transforms["frames"]) {
    EXPECT_TRUE(fs::exists(out / frame["file_path"].get<std::string>()));
    EXPECT_FALSE(frame.contains("mask_path"));
    const cv::Mat depth = cv::imread((out / frame["depth_file_path"].get<std::string>()).string(),
                                     cv::IMREAD_ANYDEPTH);
    ASSERT_EQ(depth.type(), CV_16U);
    const Json& m = frame["transform_matrix"];
    for (int y = 4; y < lens.height; y += 20)
      for (int x = 4; x < lens.width; x += 20) {
        const Vec3 ray = lens.unproject({x + 0.5, y + 0.5}).value();
        // OpenGL's camera looks along -z, its y is up.
        const double z_m = kUnit_m * depth.at<ushort>(y, x);
        const Vec3 p(z_m * ray.x() / ray.z(), -z_m * ray.y() / ray.z(), -z_m);
        Vec3 p_world_m;
        for (int i = 0; i < 3; ++i)
          p_world_m[i] = m[i][0].get<double>() * p.x() + m[i][1].get<double>() * p.y() +
                         m[i][2].get<double>() * p.z() + m[i][3].get<double>();
        // Half a step of depth, along a ray that may be 60 degrees off the axis.
        EXPECT_LE(wall(kMm * p_world_m).distance_mm, 2.0 * 0.5 * kMm * kUnit_m + kSingle);
      }
  }
  const TriangleMesh points = read_ply(out / transforms["ply_file_path"].get<std::string>());
  ASSERT_GE(points.vertices.size(), 100u);
  for (const Vec3& point : points.vertices)
    EXPECT_LE(wall(kMm * point).distance_mm, 0.01);  // metres in single precision
}

// Its reader takes unit rays for a fisheye: depth is the distance along them.
TEST_F(Export, NerfstudioHasDistancesOfAFisheye) {
  const fs::path out = exported(fisheye(), {"nerfstudio"});
  EXPECT_TRUE(noted("distance along the ray"));
  const Truth truth = Truth::open(fisheye());
  const Lens& lens = truth.camera().lens;
  const ClosestPoint wall(truth.wall());
  const cv::Mat depth = cv::imread((out / "depth" / "000003.png").string(), cv::IMREAD_UNCHANGED);
  const RowPoses poses = truth.row_poses(3);
  int off_axis = 0;
  for (int y = 4; y < lens.height; y += 8)
    for (int x = 4; x < lens.width; x += 8) {
      if (depth.at<ushort>(y, x) == 0) continue;
      const Vec3 ray = lens.unproject({x + 0.5, y + 0.5}).value();
      off_axis += ray.z() < 0.6 ? 1 : 0;
      EXPECT_LE(wall(poses.of_row(y) * (0.005 * depth.at<ushort>(y, x) * ray)).distance_mm,
                0.0025 + kSingle);
    }
  EXPECT_GE(off_axis, 10);
}

TEST_F(Export, DepthThatIsTooFarIsCounted) {
  const fs::path out = exported(polynomial(), {"tum", 3000.0});  // up to 21.8 mm
  EXPECT_TRUE(noted("pixels are farther than 21.8"));
  const cv::Mat depth = cv::imread((out / "depth" / "000002.png").string(), cv::IMREAD_UNCHANGED);
  const cv::Mat depth_mm = Truth::open(polynomial()).depth_mm(2);
  int far = 0;
  for (int y = 0; y < depth.rows; ++y)
    for (int x = 0; x < depth.cols; ++x) {
      const bool known = depth.at<ushort>(y, x) > 0;
      EXPECT_EQ(known, 3000.0 * depth_mm.at<float>(y, x) < 65535.5);
      far += known ? 0 : 1;
    }
  EXPECT_GE(far, 100);
}

TEST_F(Export, AFieldStopIsAMaskOfNerfstudio) {
  const fs::path out = exported(fisheye(), {"nerfstudio"});
  const Json transforms = Json::parse(read_text(out / "transforms.json"));
  EXPECT_EQ(transforms["camera_model"], "OPENCV_FISHEYE");
  EXPECT_EQ(transforms["frames"][0]["mask_path"], "mask.png");
  const cv::Mat mask = cv::imread((out / "mask.png").string(), cv::IMREAD_UNCHANGED);
  EXPECT_EQ(mask.at<uchar>(60, 80), 255);
  EXPECT_EQ(mask.at<uchar>(0, 0), 0);
  const fs::path colmap = exported(fisheye(), {"colmap"});
  EXPECT_EQ(read_text(colmap / "masks" / "000003.jpg.png"), read_text(out / "mask.png"));
  const fs::path tum = exported(fisheye(), {"tum"});
  EXPECT_TRUE(noted("field stop"));
  EXPECT_TRUE(fs::exists(tum / "calibration_fisheye.txt"));
  EXPECT_FALSE(fs::exists(tum / "calibration.txt"));
}

TEST_F(Export, TumListsHaveMetresAndTheUsualSteps) {
  const fs::path out = exported(polynomial(), {"tum"});
  const Truth truth = Truth::open(polynomial());
  const auto poses = numbers_in(out / "groundtruth.txt");
  ASSERT_EQ(poses.size(), static_cast<std::size_t>(kFrames));
  std::ifstream pairs(out / "associations.txt");
  for (int i = 0; i < kFrames; ++i) {
    const Rigid3& pose = truth.track()[i].world_from_camera;
    EXPECT_NEAR(poses[i][0], truth.track()[i].time_s, 1e-9);
    const Vec3 place_mm = 1e3 * Vec3(poses[i][1], poses[i][2], poses[i][3]);
    EXPECT_LE((place_mm - pose.translation).norm(), 1e-9);
    const Quat q(poses[i][7], poses[i][4], poses[i][5], poses[i][6]);
    EXPECT_LE(angle_between_rad(q, pose.rotation), 1e-7);
    std::string time, rgb, again, file;
    pairs >> time >> rgb >> again >> file;
    EXPECT_EQ(time, again);
    EXPECT_EQ(read_text(out / rgb),
              read_text(polynomial() / fmt::format("observations/frames/{:06}.png", i)));
    const cv::Mat depth = cv::imread((out / file).string(), cv::IMREAD_UNCHANGED);
    const cv::Mat depth_mm = truth.depth_mm(i);
    for (int y = 0; y < depth.rows; ++y)
      for (int x = 0; x < depth.cols; ++x)
        EXPECT_NEAR(1e3 * depth.at<ushort>(y, x) / 5000.0, depth_mm.at<float>(y, x), 0.1 + kSingle);
  }
  const auto lens = numbers_in(out / "calibration.txt");
  ASSERT_EQ(lens.size(), 1u);
  EXPECT_EQ(lens[0], (std::vector<double>{80, 82, 78, 60.5, -0.15, 0.02, 0.002, -0.001, -0.001}));

  const fs::path fine = exported(polynomial(), {"tum", 100.0});
  EXPECT_TRUE(noted("depth factor is 100000"));
  const cv::Mat depth = cv::imread((fine / "depth" / "000003.png").string(), cv::IMREAD_UNCHANGED);
  EXPECT_NEAR(depth.at<ushort>(50, 70) / 100.0, truth.depth_mm(3).at<float>(50, 70),
              0.005 + kSingle);
}

TEST_F(Export, C3vdValuesMeanWhatItsPageSays) {
  const fs::path out = exported(polynomial(), {"c3vd"});
  const Truth truth = Truth::open(polynomial());
  const Lens& lens = truth.camera().lens;
  const auto poses = numbers_in(out / "pose.txt", ',');
  ASSERT_EQ(poses.size(), static_cast<std::size_t>(kFrames));
  const ClosestPoint wall(truth.wall());
  int flows = 0, left_out = 0;
  for (int i = 0; i < kFrames; ++i) {
    ASSERT_EQ(poses[i].size(), 16u);
    const auto read = [&](const char* what) {
      return cv::imread((out / fmt::format("{:04}_{}", i, what)).string(), cv::IMREAD_UNCHANGED);
    };
    ASSERT_EQ(read("color.png").type(), CV_8UC3);
    const cv::Mat depth = read("depth.tiff"), normals = read("normals.tiff"),
                  flow = i > 0 ? read("flow.tiff") : cv::Mat();
    ASSERT_EQ(depth.type(), CV_16U);
    ASSERT_EQ(normals.type(), CV_16UC3);
    ASSERT_EQ(fs::exists(out / fmt::format("{:04}_flow.tiff", i)), i > 0);
    const cv::Mat normal = truth.normal(i), masks = truth.masks(i);
    const cv::Mat backward = i > 0 ? truth.backward_flow_px(i) : cv::Mat();
    for (int y = 0; y < lens.height; y += 3)
      for (int x = 0; x < lens.width; x += 3) {
        const double z = 100.0 * depth.at<ushort>(y, x) / 65535.0;
        if (z == 0.0 || z == 100.0) continue;
        // Their reader multiplies row vectors by the 4 x 4 numbers of a line.
        const Vec3 ray = lens.unproject({x + 0.5, y + 0.5}).value();
        const double p[4] = {z * ray.x() / ray.z(), z * ray.y() / ray.z(), z, 1.0};
        Vec3 p_world = Vec3::Zero();
        for (int row = 0; row < 4; ++row)
          for (int column = 0; column < 3; ++column)
            p_world[column] += p[row] * poses[i][4 * row + column];
        EXPECT_LE(wall(p_world).distance_mm, 2.0 * 0.5 * 100.0 / 65535.0 + kSingle);
        for (int axis = 0; axis < 3; ++axis)  // OpenCV has blue first
          EXPECT_NEAR(2.0 * normals.at<cv::Vec3w>(y, x)[2 - axis] / 65535.0 - 1.0,
                      normal.at<cv::Vec3f>(y, x)[axis], 1.0 / 65535.0 + 1e-6);
        if (i == 0) continue;
        const cv::Vec3w& code = flow.at<cv::Vec3w>(y, x);
        const cv::Vec2f& expected = backward.at<cv::Vec2f>(y, x);
        const bool hidden = (masks.at<uchar>(y, x) & kMaskBackwardFlowOccluded) != 0;
        const bool can_be_said =
            !hidden && std::abs(expected[0]) <= 20.0f && std::abs(expected[1]) <= 20.0f;
        ++(can_be_said ? flows : left_out);
        for (int axis = 0; axis < 2; ++axis) {
          const double value = 40.0 * code[2 - axis] / 65535.0 - 20.0;
          if (can_be_said)
            EXPECT_NEAR(value, expected[axis], 20.0 / 65535.0 + 1e-5);
          else
            EXPECT_EQ(value, -20.0);
        }
      }
  }
  EXPECT_GE(flows, 500);
  EXPECT_GE(left_out, 10);
  EXPECT_TRUE(noted("20 px"));

  const fs::path without = exported(fisheye(), {"c3vd"});  // JPEG frames, no backward flow
  EXPECT_TRUE(fs::exists(without / "0000_color.png"));
  EXPECT_FALSE(fs::exists(without / "0001_flow.tiff"));
  EXPECT_TRUE(noted("truth.backward_flow=true"));
}

TEST_F(Export, GoesOnWhereItStoppedAndTakesNoOtherFolder) {
  const fs::path out = exported(polynomial(), {"tum"});
  const fs::path depth = out / "depth" / "000005.png", list = out / "rgb.txt";
  const std::string bytes = read_text(depth), names = read_text(list);
  const auto untouched = out / "depth" / "000004.png";
  const auto written = fs::last_write_time(untouched);
  fs::remove(depth);
  fs::remove(list);
  Progress progress(Progress::Output::silent);
  export_dataset(polynomial(), {"tum"}, out, progress);
  EXPECT_EQ(read_text(depth), bytes);
  EXPECT_EQ(read_text(list), names);
  EXPECT_EQ(fs::last_write_time(untouched), written);

  const auto refused = [&](const fs::path& dataset, const ExportOptions& options,
                           const fs::path& to) {
    return message_of([&] { export_dataset(dataset, options, to, progress); });
  };
  const std::string other =
      out.string() +
      ": holds another export (dataset, format or depth-per-mm differ); choose "
      "another folder or remove it";
  EXPECT_EQ(refused(polynomial(), {"colmap"}, out), other);
  EXPECT_EQ(refused(polynomial(), {"tum", 50.0}, out), other);
  EXPECT_EQ(refused(fisheye(), {"tum"}, out), other);
  make_folder(root_ / "mine");
  write_atomic(root_ / "mine" / "notes.txt", "x");
  EXPECT_EQ(refused(polynomial(), {"tum"}, root_ / "mine"),
            (root_ / "mine").string() + ": holds notes.txt, expected an empty folder");
  EXPECT_EQ(refused(polynomial(), {"tun"}, root_ / "new"),
            "format 'tun': no such format; did you mean 'tum'?; known: tum, colmap, nerfstudio, "
            "c3vd");
  EXPECT_EQ(refused(polynomial(), {"c3vd", 5.0}, root_ / "new"),
            "depth-per-mm is 5, but c3vd has no choice of it");
  for (const double steps : {-1.0, 0.001, 1e6})
    EXPECT_EQ(
        refused(polynomial(), {"tum", steps}, root_ / "new"),
        fmt::format("depth-per-mm is {}, expected steps of depth a millimetre, 1 to 65535", steps));
  EXPECT_EQ(refused(root_ / "mine", {"tum"}, root_ / "new"),
            (root_ / "mine").string() + ": not a dataset (no dataset.json)");
  EXPECT_FALSE(fs::exists(root_ / "new"));
  const fs::path inside = polynomial() / "tum";
  EXPECT_EQ(refused(polynomial(), {"tum"}, inside),
            inside.string() + ": lies in the dataset, expected a folder outside of it");
  EXPECT_FALSE(fs::exists(inside));
}

}  // namespace
}  // namespace rugae
