#include "studies/report.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <opencv2/imgcodecs.hpp>

#include "core/files.h"
#include "core/presets.h"
#include "studies/html.h"
#include "studies/plots.h"
#include "studies/tables.h"
#include "tests/studies/from_base64.h"
#include "tests/studies/in_temporary_folder.h"
#include "tests/studies/inside_sphere.h"
#include "tests/studies/page_without_viewer.h"
#include "validate/evaluate.h"

namespace rugae {
namespace {

class Report : public InTemporaryFolder {
 protected:
  std::string page() {
    inside_sphere::write_dataset(folder_ / "data");
    inside_sphere::write_estimate_of_truth(folder_ / "estimate", 0.05);
    const auto pictures = EstimateLayout{folder_ / "estimate"}.pictures();
    for (const char* stage : {"original", "mask", "preprocessed", "another"}) {
      std::filesystem::create_directories(pictures / stage);
      write_image(pictures / stage / "000000.png", cv::Mat(20, 30, CV_8UC3, cv::Scalar(1, 2, 3)));
    }
    Study study;
    study.title = "Title & <more>";
    study.text = "cameras: [a]\n";
    study.parts.resize(1);
    CellResult cell;
    cell.cell = {"misumi-v5506", "1", "paper"};
    cell.dataset = folder_ / "data";
    cell.estimate = folder_ / "estimate";
    Progress progress(Progress::Output::silent);
    cell.metrics = evaluate(cell.dataset, cell.estimate, progress);
    cell.metrics["simulation"] = {{"frames_per_s", 12.0}, {"frames", 12}};
    return report_html(study, {{study.parts[0], {cell}, {}, {}}}, progress);
  }
};

TEST_F(Report, IsOneFileWhosePicturesDecodeAndWhoseNumbersAreNumbers) {
  const std::string html = without_viewer(page());
  EXPECT_EQ(html.find("http"), std::string::npos);
  EXPECT_EQ(html.find("{{"), std::string::npos);
  EXPECT_NE(html.find("Title &amp; &lt;more&gt;"), std::string::npos);
  EXPECT_NE(html.find("the paper: 41.7 mm"), std::string::npos);
  int pictures = 0;
  const std::string mark = ";base64,";
  for (auto at = html.find("src=\""); at != std::string::npos; at = html.find("src=\"", at + 1)) {
    const std::string source = html.substr(at + 5, html.find('"', at + 5) - at - 5);
    ASSERT_EQ(source.rfind("data:image/", 0), 0u) << source.substr(0, 60);
    const cv::Mat image = cv::imdecode(from_base64(source.substr(source.find(mark) + mark.size())),
                                       cv::IMREAD_UNCHANGED);
    ASSERT_FALSE(image.empty()) << source.substr(0, 60);
    ++pictures;
  }
  for (const char* bad : {">nan<", ">-nan<", "Mnan", "Lnan", "inf mm"})
    EXPECT_EQ(html.find(bad), std::string::npos) << bad;
  EXPECT_GE(pictures, 5 * 5 + 6);  // five labels of five frames, six views of map and wall
}

// The page as it is made from a source tree whose viewer was built, or was not.
class ReportWithTree : public Report {
 protected:
  void SetUp() override {
    Report::SetUp();
    tree_ = folder_ / "tree";
    std::filesystem::create_directories(tree_ / "viewer" / "dist");
    std::filesystem::copy_file(preset_root() / "viewer" / "report.html",
                               tree_ / "viewer" / "report.html");
    std::filesystem::create_directory_symlink(preset_root() / "studies", tree_ / "studies");
    if (const char* home = std::getenv("RUGAE_HOME")) home_before_ = home;
    setenv("RUGAE_HOME", tree_.c_str(), 1);
  }
  void TearDown() override {
    if (home_before_.empty())
      unsetenv("RUGAE_HOME");
    else
      setenv("RUGAE_HOME", home_before_.c_str(), 1);
    Report::TearDown();
  }
  std::filesystem::path tree_;
  std::string home_before_;
};

TEST_F(ReportWithTree, SaysThatItsViewerWasNotBuilt) {
  const std::string html = page();
  EXPECT_NE(html.find("This page has no interactive views"), std::string::npos);
  EXPECT_EQ(html.find("class=\"view-data\""), std::string::npos);
  EXPECT_EQ(html.find("class=\"viewer\""), std::string::npos);
  EXPECT_NE(html.find("Inside the stomach"), std::string::npos);
}

TEST_F(ReportWithTree, HoldsItsViewerAndTheDataOfItsViews) {
  write_atomic(tree_ / "viewer" / "dist" / "viewer.js", "let drawn = 1 && {{2}};");
  const std::string html = page();
  EXPECT_NE(html.find("<script class=\"viewer\">let drawn = 1 && {{2}};</script>"),
            std::string::npos);
  EXPECT_NE(html.find("<script type=\"application/json\" class=\"view-data\">"), std::string::npos);
  EXPECT_EQ(html.find("This page has no interactive views"), std::string::npos);
}

TEST(Html, EscapesAndRounds) {
  EXPECT_EQ(html::escape("a<b & \"c\""), "a&lt;b &amp; &quot;c&quot;");
  EXPECT_EQ(html::link_to("noise 50%_1-a"), "#noise%2050%25_1-a");
  EXPECT_EQ(html::number(41.74), "41.7");
  EXPECT_EQ(html::number(0.012345), "0.0123");
  EXPECT_EQ(html::number(1234.5), "1234");
  EXPECT_EQ(html::number(0.0), "0");
  EXPECT_EQ(html::number(std::nan("")), "&ndash;");
}

TEST(Html, PicturesSurviveTheirCoding) {
  cv::Mat image(5, 7, CV_8UC3);
  for (int i = 0; i < 5 * 7 * 3; ++i) image.data[i] = static_cast<unsigned char>(37 * i);
  for (const int columns : {5, 6, 7}) {  // byte counts of every remainder by three
    const cv::Mat part = image.colRange(0, columns).clone();
    const std::string uri = html::png(part);
    const cv::Mat back = cv::imdecode(from_base64(uri.substr(uri.find(',') + 1)), cv::IMREAD_COLOR);
    ASSERT_EQ(back.size(), part.size());
    EXPECT_EQ(cv::norm(back, part, cv::NORM_INF), 0.0);
  }
}

TEST(Plots, NiceStepsAreOneTwoOrFive) {
  EXPECT_DOUBLE_EQ(nice_step(10.0, 5), 2.0);
  EXPECT_DOUBLE_EQ(nice_step(37.0, 4), 10.0);
  EXPECT_DOUBLE_EQ(nice_step(0.9, 4), 0.5);
  EXPECT_DOUBLE_EQ(nice_step(1.0, 10), 0.1);
}

TEST(Plots, ALostFrameInterruptsTheCurve) {
  const std::string svg = time_svg({"Error", "mm", {0, 1, 2, 3}, {1, std::nan(""), 2, 3}, {0.0}});
  EXPECT_NE(svg.find("class=\"lost\""), std::string::npos);
  const auto curve = svg.substr(svg.find("class=\"curve\""));
  const std::string data = curve.substr(0, curve.find("/>"));
  EXPECT_EQ(std::ranges::count(data, 'M'), 2);
  EXPECT_EQ(std::ranges::count(data, 'L'), 1);
}

TEST(Tables, CsvHasARowACellAndEmptyPlacesWhereNothingWasMeasured) {
  CellResult a, b;
  a.cell = {"cam", "1", "paper"};
  a.metrics = {{"x", {{"y_mm", 1.5}, {"z_mm", nullptr}}}, {"frames", {{"time_s", {1, 2}}}}};
  b.cell = {"cam,2", "1", "paper"};
  b.metrics = {{"x", {{"y_mm", 2.5}, {"z_mm", 3.0}}}};
  EXPECT_EQ(
      table_csv({a, b}),
      "part,camera,trajectory,method,seed,x.y_mm,x.z_mm\n,cam,1,paper,1,1.5,\n,\"cam,2\",1,paper,1,"
      "2.5,3\n");
}

}  // namespace
}  // namespace rugae
