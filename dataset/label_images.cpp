#include "dataset/label_images.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <opencv2/core.hpp>
#include <string_view>

#include "core/check.h"
#include "dataset/image_io.h"
#include "dataset/truth.h"

namespace rugae {
namespace {

using Set = LabelSet;
using Truth = FrameTruth;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr LabelImage kLabels[] = {
    {"depth", &Set::depth, &Truth::depth_mm, CV_32FC1, LabelCoding::values, kNone, "depth"},
    {"range", &Set::range, &Truth::range_mm, CV_32FC1, LabelCoding::values, kNone, "range"},
    {"normals", &Set::normals, &Truth::normal, CV_32FC3, LabelCoding::normals, kNone, "normal"},
    {"shading_normals", &Set::shading_normals, &Truth::shading_normal, CV_32FC3,
     LabelCoding::normals, kNone, "shading normal"},
    {"masks", &Set::masks, &Truth::masks, CV_8UC1, LabelCoding::numbers, 0.0, "masks"},
    {"flow", &Set::flow, &Truth::flow_px, CV_32FC2, LabelCoding::values, kNone, "flow"},
    {"backward_flow", &Set::backward_flow, &Truth::backward_flow_px, CV_32FC2, LabelCoding::values,
     kNone, "backward flow"},
    {"triangles", &Set::triangles, &Truth::triangle, CV_32FC3, LabelCoding::values, kNone,
     "triangle"},
    {"albedo", &Set::albedo, &Truth::albedo, CV_32FC3, LabelCoding::share, kNone, "albedo"},
    {"diffuse", &Set::diffuse, &Truth::diffuse, CV_32FC3, LabelCoding::colour, 0.0,
     "diffuse light"},
    {"specular", &Set::specular, &Truth::specular, CV_32FC1, LabelCoding::values, 0.0,
     "specular light"},
    {"indirect", &Set::indirect, &Truth::indirect, CV_32FC3, LabelCoding::colour, 0.0,
     "light over other walls"},
    {"regions", &Set::regions, &Truth::region, CV_8UC1, LabelCoding::numbers, 0.0, "region"},
    {"instances", &Set::instances, &Truth::instance, CV_8UC1, LabelCoding::numbers, 0.0,
     "instance"}};

LabelSet every(bool wanted) {
  LabelSet set;
  for (const LabelImage& label : kLabels) set.*label.wanted = wanted;
  return set;
}

}  // namespace

LabelSet LabelSet::none() { return every(false); }
LabelSet LabelSet::all() { return every(true); }

std::span<const LabelImage> label_images() { return kLabels; }

const LabelImage& label_image(const std::string& name) {
  const auto* const found = std::ranges::find_if(
      kLabels, [&name](const LabelImage& label) { return name == label.name; });
  check(found != std::end(kLabels), "no label is called '{}'", name);
  return *found;
}

bool LabelImage::exists_for(int frame, int frames) const {
  if (wanted == &LabelSet::flow) return frame + 1 < frames;
  if (wanted == &LabelSet::backward_flow) return frame > 0;
  return true;
}

std::filesystem::path LabelImage::file(const DatasetLayout& layout, int frame) const {
  const bool png = coding == LabelCoding::normals || coding == LabelCoding::numbers;
  return layout.truth() / name / fmt::format("{:06}.{}", frame, png ? "png" : "exr");
}

void LabelImage::write(const std::filesystem::path& file, const cv::Mat& image) const {
  switch (coding) {
    case LabelCoding::values:
      return write_exr(file, image);
    case LabelCoding::colour:
      return write_radiance(file, image);
    case LabelCoding::share:
      return write_half_rgb(file, image);
    case LabelCoding::normals:
      return write_normals(file, image, wanted == &LabelSet::shading_normals);
    case LabelCoding::numbers:
      return write_image(file, image);
  }
}

cv::Mat LabelImage::read(const std::filesystem::path& file) const {
  switch (coding) {
    case LabelCoding::values:
      return read_exr(file);
    case LabelCoding::colour:
    case LabelCoding::share:
      return read_rgb_exr(file);
    case LabelCoding::normals:
      return read_normals(file);
    case LabelCoding::numbers:
      return read_image_as_stored(file);
  }
  return {};
}

}  // namespace rugae
