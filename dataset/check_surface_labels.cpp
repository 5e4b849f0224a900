#include "dataset/check_surface_labels.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <opencv2/core.hpp>

#include "core/check.h"
#include "dataset/csv.h"
#include "dataset/image_io.h"
#include "dataset/label_images.h"

namespace rugae {
namespace fs = std::filesystem;
namespace {

// Both are float32 numbers of the same hit: a last bit each.
constexpr double kSameNumber = 1e-6;
// Three float32 parts, rounded once more each when they were brought to the sensor's scale.
constexpr double kSameLight = 2e-6;
std::set<int> first_column(const fs::path& file, const std::string& header) {
  std::set<int> numbers;
  for (const CsvLine& line : read_csv(file, header))
    numbers.insert(static_cast<int>(csv_number(file, line, 0)));
  return numbers;
}

class SurfaceCheck {
 public:
  SurfaceCheck(const LabelSources& in, const NamedNumbers& named, int index)
      : in_(in), named_(named), index_(index) {}

  std::vector<LabelProblem> run() {
    check_range();
    for (const char* name : {"albedo", "diffuse", "specular", "indirect"}) check_light(name);
    check_sum();
    check_numbers("regions", named_.regions, "regions.csv");
    check_numbers("instances", named_.instances, "instances.csv");
    check_shading_normals();
    return std::move(problems_);
  }

 private:
  fs::path file(const char* name) const { return label_image(name).file(in_.layout, index_); }

  // Empty where the frame has no such label, or one that cannot be read. Each file is read once.
  cv::Mat image(const std::string& name) {
    const auto [at, fresh] = images_.try_emplace(name);
    if (fresh) at->second = read(label_image(name));
    return at->second;
  }
  cv::Mat read(const LabelImage& label) {
    const fs::path from = label.file(in_.layout, index_);
    if (!fs::exists(from)) return {};
    try {
      cv::Mat image = label.read(from);
      check(image.type() == label.type && image.cols == in_.lens.width &&
                image.rows == in_.lens.height,
            "{}: {} x {} px of {}, expected {} x {} of {}", from.string(), image.cols, image.rows,
            cv::typeToString(image.type()), in_.lens.width, in_.lens.height,
            cv::typeToString(label.type));
      return image;
    } catch (const Error& error) {
      problems_.push_back({"unreadable", error.what()});
      return {};
    }
  }

  // Notes the first pixel for which `problem` says something.
  void first_pixel(const char* name, const std::function<std::string(int, int)>& problem) {
    for (int y = 0; y < in_.lens.height; ++y)
      for (int x = 0; x < in_.lens.width; ++x)
        if (const std::string text = problem(y, x); !text.empty()) {
          problems_.push_back(
              {name, fmt::format("{}: at column {}, row {} {}", file(name).string(), x, y, text)});
          return;
        }
  }

  void check_range() {
    const cv::Mat range = image("range"), depth = image("depth");
    if (range.empty() || depth.empty()) return;
    first_pixel("range", [&](int y, int x) -> std::string {
      const double r = range.at<float>(y, x), z = depth.at<float>(y, x);
      if (std::isnan(r) && std::isnan(z)) return {};
      const auto ray = in_.lens.unproject(Vec2(x + 0.5, y + 0.5));
      if (ray && std::abs(r * ray->z() - z) <= kSameNumber * std::abs(r)) return {};
      return fmt::format("the range is {:g} mm, but the depth is {:g} mm along z", r, z);
    });
  }

  void check_light(const char* name) {
    const cv::Mat light = image(name);
    if (light.empty()) return;
    const bool share = std::string_view(name) == "albedo";
    const int channels = light.channels();
    first_pixel(name, [&](int y, int x) -> std::string {
      const float* v = light.ptr<float>(y) + x * channels;
      for (int c = 0; c < channels; ++c) {
        if (share && std::isnan(v[c])) continue;  // nothing was met
        if (!(v[c] >= 0.0f && std::isfinite(v[c]))) return fmt::format("there is {:g}", v[c]);
        if (share && v[c] > 1.0f) return fmt::format("there is {:g}, more than all light", v[c]);
      }
      return {};
    });
  }

  // diffuse + specular + indirect = radiance, where the colours are those of one ray a pixel.
  void check_sum() {
    const fs::path whole_file = in_.layout.radiance(index_);
    if (!in_.sharp || !fs::exists(whole_file)) return;
    const cv::Mat diffuse = image("diffuse"), specular = image("specular");
    if (diffuse.empty() || specular.empty()) return;
    const cv::Mat indirect = image("indirect");
    const cv::Mat whole = read_rgb_exr(whole_file);
    if (whole.size() != diffuse.size()) return;  // told by the check of images
    first_pixel("diffuse", [&](int y, int x) -> std::string {
      const auto &all = whole.at<cv::Vec3f>(y, x), &d = diffuse.at<cv::Vec3f>(y, x);
      const float s = specular.at<float>(y, x);
      for (int c = 0; c < 3; ++c) {
        const double sum = d[c] + s + (indirect.empty() ? 0.0f : indirect.at<cv::Vec3f>(y, x)[c]);
        if (!(std::abs(sum - all[c]) <= kSameLight * std::max(std::abs(sum), 1e-9)))
          return fmt::format("the parts of the light add up to {:g}, {} has {:g}", sum,
                             whole_file.string(), all[c]);
      }
      return {};
    });
  }

  void check_numbers(const char* name, const std::set<int>& named, const char* table) {
    const cv::Mat numbers = image(name);
    if (numbers.empty()) return;
    first_pixel(name, [&](int y, int x) -> std::string {
      const int number = numbers.at<unsigned char>(y, x);
      if (number == 0 || named.contains(number)) return {};
      return fmt::format("there is {}, which {} does not name", number, table);
    });
  }

  // The wall has a normal wherever it has a depth, and nowhere else.
  void check_shading_normals() {
    const cv::Mat normals = image("shading_normals"), depth = image("depth");
    if (normals.empty() || depth.empty()) return;
    first_pixel("shading_normals", [&](int y, int x) -> std::string {
      const bool there = !std::isnan(normals.at<cv::Vec3f>(y, x)[0]);
      if (there == !std::isnan(depth.at<float>(y, x))) return {};
      return there ? "there is a normal, but no depth" : "there is no normal, but a depth";
    });
  }

  const LabelSources& in_;
  const NamedNumbers& named_;
  int index_;
  std::map<std::string, cv::Mat> images_;
  std::vector<LabelProblem> problems_;
};

}  // namespace

NamedNumbers read_named_numbers(const DatasetLayout& layout) {
  NamedNumbers named;
  if (fs::exists(layout.regions())) named.regions = first_column(layout.regions(), "region,name");
  if (fs::exists(layout.instances()))
    named.instances = first_column(
        layout.instances(),
        "id,kind,x_mm,y_mm,z_mm,inward_x,inward_y,inward_z,radius_mm,height_mm,region");
  return named;
}

std::vector<LabelProblem> check_surface_labels(const LabelSources& sources,
                                               const NamedNumbers& named, int index) {
  return SurfaceCheck(sources, named, index).run();
}

}  // namespace rugae
