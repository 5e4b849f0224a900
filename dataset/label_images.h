#pragma once
// The label images of a frame: one list of what there is and how it is stored, for settings,
// writer, checks and readers.

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <span>
#include <string>

#include "dataset/layout.h"

namespace rugae {

struct FrameTruth;

/// Which label images a dataset has.
struct LabelSet {
  bool depth = true, normals = true, flow = true, masks = true;
  bool backward_flow = false;
  bool range = false;            // distance along the ray
  bool triangles = false;        // triangle and barycentric coordinates
  bool shading_normals = false;  // interpolated over the triangle, as light sees them
  bool albedo = false;
  bool diffuse = false, specular = false, indirect = false;  // what the light is made of
  bool regions = false;                                      // of the organ: truth/regions.csv
  bool instances = false;  // lesions and objects: truth/instances.csv

  static LabelSet none();
  static LabelSet all();
  bool operator==(const LabelSet&) const = default;
};

enum class LabelCoding {
  values,   // OpenEXR, float32; channels Y, or x y, or x y z
  colour,   // OpenEXR, float32; channels R G B
  share,    // OpenEXR, float16 (11 bits); channels R G B
  normals,  // PNG, 16 bits: see write_normals
  numbers,  // PNG, 8 bits, one channel
};

struct LabelImage {
  const char* name;  // of the setting, of the folder below truth/, in dataset.json
  bool LabelSet::*wanted;
  cv::Mat FrameTruth::*image;
  int type;  // OpenCV's, in memory
  LabelCoding coding;
  double nothing;    // where the ray met no wall: not a number, or 0 for bits, numbers and light
  const char* what;  // for messages and pictures

  /// Flow leads from the last frame nowhere, and backward flow from the first.
  bool exists_for(int frame, int frames) const;
  std::filesystem::path file(const DatasetLayout& layout, int frame) const;
  /// Throws Error naming the file.
  void write(const std::filesystem::path& file, const cv::Mat& image) const;
  cv::Mat read(const std::filesystem::path& file) const;
};

/// In the order in which they are written.
std::span<const LabelImage> label_images();
/// By its name; throws Error where there is no such label.
const LabelImage& label_image(const std::string& name);

}  // namespace rugae
