#include "studies/report_view.h"

#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "tests/studies/from_base64.h"
#include "tests/studies/in_temporary_folder.h"
#include "tests/studies/inside_sphere.h"
#include "validate/evaluate.h"
#include "validate/surface_error.h"

namespace rugae {
namespace {

using nlohmann::json;

constexpr double kMapRadius_mm = inside_sphere::kRadius_mm + 1.0;

json script(const std::string& html, const std::string& css_class) {
  const std::string open = "<script type=\"application/json\" class=\"" + css_class + "\">";
  const auto begin = html.find(open);
  if (begin == std::string::npos) return {};
  const auto end = html.find("</script>", begin);
  return json::parse(html.substr(begin + open.size(), end - begin - open.size()));
}

std::vector<float> floats(const json& text) {
  const auto bytes = from_base64(text);
  std::vector<float> out(bytes.size() / sizeof(float));
  std::memcpy(out.data(), bytes.data(), out.size() * sizeof(float));
  return out;
}

std::vector<Vec3> points_of(const json& mesh) {
  const auto bytes = from_base64(mesh.at("points"));
  std::vector<std::uint16_t> numbers(bytes.size() / sizeof(std::uint16_t));
  std::memcpy(numbers.data(), bytes.data(), bytes.size());
  const auto corner = mesh.at("corner_mm").get<std::vector<double>>();
  const double step_mm = mesh.at("step_mm");
  std::vector<Vec3> out;
  for (std::size_t i = 0; i < numbers.size(); i += 3)
    out.push_back(Vec3(corner[0], corner[1], corner[2]) +
                  step_mm * Vec3(numbers[i], numbers[i + 1], numbers[i + 2]));
  return out;
}

// A camera inside a sphere, and an estimate of it that is true but for a map 1 mm too large.
class ReportView : public InTemporaryFolder {
 protected:
  void SetUp() override {
    InTemporaryFolder::SetUp();
    cell_.cell = {"test", "1", "paper"};
    cell_.dataset = folder_ / "data";
    cell_.estimate = folder_ / "estimate";
    inside_sphere::write_dataset(cell_.dataset);
    inside_sphere::write_estimate_of_truth(cell_.estimate, 0.05, kMapRadius_mm);
  }

  void measure() {
    Progress progress(Progress::Output::silent);
    cell_.metrics = evaluate(cell_.dataset, cell_.estimate, progress);
    estimate_ = read_estimate(cell_.estimate);
  }

  std::string part(ReportViews& views) {
    const Truth truth = Truth::open(cell_.dataset);
    const CellView view{cell_, truth, estimate_};
    views.add_wall(truth.wall());
    return views.walls() +
           views.part(view, map_over_truth(view), FramePictures(view, shown_frames(view)));
  }

  CellResult cell_;
  Estimate estimate_;
};

TEST_F(ReportView, ShowsTheMapByItsDistance) {
  measure();
  ReportViews views(100);  // so many that the map must have fewer triangles
  const Truth truth = Truth::open(cell_.dataset);
  const CellView view{cell_, truth, estimate_};
  const MapOverTruth over = map_over_truth(view);
  views.add_wall(truth.wall());
  const json map =
      script(views.part(view, over, FramePictures(view, shown_frames(view))), "view-data")
          .at("map");
  const double worst_mm = map.at("worst_mm");
  const auto shares = from_base64(map.at("error"));
  const std::vector<Vec3> vertices = points_of(map);
  ASSERT_EQ(shares.size(), vertices.size());
  ASSERT_LT(vertices.size(), over.map.vertices.size());
  const std::vector<double> expected_mm = distances_mm(vertices, over.seen_wall);
  double least_mm = worst_mm;
  for (std::size_t v = 0; v < shares.size(); ++v) {
    const double shown_mm = shares[v] / 255.0 * worst_mm;
    // A colour is a step of worst / 255; the simplified map lies up to 0.1 mm off the full one.
    ASSERT_NEAR(shown_mm, std::min(expected_mm[v], worst_mm), worst_mm / 255.0 + 0.1);
    least_mm = std::min(least_mm, shown_mm);
  }
  // The spheres are 1 mm apart; beyond the part that was seen, the distance grows.
  EXPECT_NEAR(least_mm, kMapRadius_mm - inside_sphere::kRadius_mm, worst_mm / 255.0 + 0.05);
}

TEST_F(ReportView, ShowsBothPathsAndTheLostFrame) {
  measure();
  ReportViews views(1);
  const json data = script(part(views), "view-data");
  const auto truth = floats(data.at("path").at("truth_mm"));
  const auto estimate = floats(data.at("path").at("estimate_mm"));
  const PoseTrack track = inside_sphere::track();
  ASSERT_EQ(truth.size(), 3 * track.size());
  ASSERT_EQ(estimate.size(), truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const double expected = track[i / 3].world_from_camera.translation[static_cast<int>(i % 3)];
    ASSERT_NEAR(truth[i], expected, 1e-5);
    if (i / 3 == 5)
      ASSERT_TRUE(std::isnan(estimate[i]));
    else
      ASSERT_NEAR(estimate[i], expected, 1e-3);
  }
  const json& stops = data.at("stops");
  ASSERT_EQ(stops.size(), track.size());
  EXPECT_TRUE(stops[5].at("estimate").is_null());
  for (const std::size_t i : {std::size_t{0}, std::size_t{4}, track.size() - 1}) {
    const Rigid3& pose = track[i].world_from_camera;
    const std::vector<double> expected{
        pose.translation.x(), pose.translation.y(), pose.translation.z(), pose.rotation.x(),
        pose.rotation.y(),    pose.rotation.z(),    pose.rotation.w()};
    for (std::size_t k = 0; k < expected.size(); ++k) {
      EXPECT_NEAR(stops[i].at("pose")[k].get<double>(), expected[k], 1e-6);
      EXPECT_NEAR(stops[i].at("estimate")[k].get<double>(), expected[k], 1e-3);
    }
  }
}

TEST_F(ReportView, EveryStopHasItsPictures) {
  measure();
  ReportViews views(1);
  const json data = script(part(views), "view-data");
  EXPECT_EQ(data.at("labels").size(), 4u);
  const json& stops = data.at("stops");
  for (std::size_t i = 0; i < stops.size(); ++i) {
    EXPECT_EQ(stops[i].at("index"), i);
    const json& pictures = stops[i].at("pictures");
    EXPECT_EQ(pictures.contains("flow"), i + 1 < stops.size());  // the last frame has none
    for (const char* name : {"frame", "depth", "normals", "masks"}) {
      const std::string uri = pictures.at(name);
      const cv::Mat image =
          cv::imdecode(from_base64(uri.substr(uri.find(',') + 1)), cv::IMREAD_COLOR);
      EXPECT_EQ(image.cols, inside_sphere::kWidth) << name;
      EXPECT_EQ(image.rows, inside_sphere::kHeight) << name;
    }
  }
  EXPECT_NE(stops[0].at("pictures").at("frame"), stops[6].at("pictures").at("frame"));
}

TEST_F(ReportView, CornersAreThoseOfTheLens) {
  measure();
  ReportViews views(1);
  const json rays = script(part(views), "view-data").at("corner_rays");
  ASSERT_EQ(rays.size(), 4u);
  // 96 x 72 px at a focal length of 48 px: slopes of 1 and 0.75.
  const double length = std::sqrt(1.0 + 0.75 * 0.75 + 1.0);
  EXPECT_NEAR(rays[0][0].get<double>(), -1.0 / length, 1e-12);
  EXPECT_NEAR(rays[0][1].get<double>(), -0.75 / length, 1e-12);
  EXPECT_NEAR(rays[2][0].get<double>(), 1.0 / length, 1e-12);
  EXPECT_NEAR(rays[2][1].get<double>(), 0.75 / length, 1e-12);
}

TEST_F(ReportView, AFailedCellStillShowsTheTruth) {
  cell_.metrics = {{"failed", "no tracks"}, {"tracking", {{"frames", 12}, {"tracked", 0}}}};
  ReportViews views(1);
  const std::string html = part(views);
  const json data = script(html, "view-data");
  EXPECT_TRUE(data.at("map").is_null());
  for (const float v : floats(data.at("path").at("estimate_mm"))) EXPECT_TRUE(std::isnan(v));
  EXPECT_EQ(floats(data.at("path").at("truth_mm")).size(), 3u * inside_sphere::kFrames);
  for (const json& stop : data.at("stops")) EXPECT_TRUE(stop.at("estimate").is_null());
  EXPECT_EQ(script(html, "wall-data").at("id"), data.at("wall").at("id"));
  const auto seen = from_base64(data.at("wall").at("seen"));
  EXPECT_GT(std::ranges::count(seen, 255), 0);
  EXPECT_GT(std::ranges::count(seen, 0), 0);
}

TEST_F(ReportView, CellsShareTheirWall) {
  cell_.metrics = {{"failed", "no tracks"}};
  ReportViews views(2);
  const std::string first = part(views), second = part(views);
  EXPECT_EQ(views.walls(), first.substr(0, views.walls().size()));  // the second added none
  EXPECT_EQ(script(second, "view-data").at("wall").at("id"),
            script(views.walls(), "wall-data").at("id"));
}

TEST_F(ReportView, ManyCellsShareThePage) {
  cell_.metrics = {{"failed", "no tracks"}};
  ReportViews views(100);
  const json stops = script(part(views), "view-data").at("stops");
  ASSERT_EQ(stops.size(), 8u);
  EXPECT_EQ(stops.front().at("index"), 0);
  EXPECT_EQ(stops.back().at("index"), inside_sphere::kFrames - 1);
}

}  // namespace
}  // namespace rugae
