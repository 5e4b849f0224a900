#include "dataset/check_labels.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/core.hpp>

#include "core/check.h"
#include "dataset/image_io.h"
#include "dataset/label_values.h"

namespace rugae {
namespace fs = std::filesystem;
namespace {

constexpr int kSamplesAcross = 24;  // of the grid on which normals are looked at

struct Label {
  fs::path file;
  cv::Mat image;
};

// Reads one label into `label`; false when it is not there or broken, with the problem noted.
bool read_label(Label& label, const std::function<cv::Mat(const fs::path&)>& read, int type,
                const Lens& lens, LabelCheck& result) {
  if (!fs::exists(label.file)) return false;  // told by whoever compares the list of files
  try {
    label.image = read(label.file);
    check(label.image.type() == type && label.image.cols == lens.width &&
              label.image.rows == lens.height,
          "{}: {} x {} px of {}, expected {} x {} of {}", label.file.string(), label.image.cols,
          label.image.rows, cv::typeToString(label.image.type()), lens.width, lens.height,
          cv::typeToString(type));
  } catch (const Error& error) {
    result.problems.push_back({"unreadable", error.what()});
    return false;
  }
  return true;
}

// Looks at every pixel and notes the first at which the label is there without the mask's bit or
// the bit without the label.
void check_presence(const Label& label, const Label& masks, unsigned char bit, const char* name,
                    const std::function<bool(int, int)>& present, LabelCheck& result) {
  for (int y = 0; y < masks.image.rows; ++y)
    for (int x = 0; x < masks.image.cols; ++x) {
      const bool promised = (masks.image.at<unsigned char>(y, x) & bit) != 0;
      if (promised == present(y, x)) continue;
      result.problems.push_back(
          {std::string(name) + " and mask",
           fmt::format("{}: at column {}, row {} there is {} {} though {} says {}valid",
                       label.file.string(), x, y, promised ? "no" : "a", name, masks.file.string(),
                       promised ? "" : "in")});
      return;
    }
}

void check_flow(const LabelSources& in, int index, const Label& depth, const Label& flow,
                const Label& masks, LabelCheck& result) {
  try {
    result.flow = compare_flow(in, index, depth.image, flow.image, masks.image);
  } catch (const Error& error) {
    result.problems.push_back({"unreadable", error.what()});
  }
}

void check_facing(const Lens& lens, const Label& normals, LabelCheck& result) {
  const int step = std::max(1, lens.width / kSamplesAcross);
  for (int y = step / 2; y < lens.height; y += step)
    for (int x = step / 2; x < lens.width; x += step) {
      const cv::Vec3f n = normals.image.at<cv::Vec3f>(y, x);
      const auto ray = lens.unproject(Vec2(x + 0.5, y + 0.5));
      // 1e-4: the normal is rounded to 16 bits; a wall seen exactly edge-on may round away.
      constexpr double kEdgeOn = 1e-4;
      if (!ray || std::isnan(n[0]) || ray->dot(Vec3(n[0], n[1], n[2])) <= kEdgeOn) continue;
      result.problems.push_back(
          {"facing", fmt::format("{}: at column {}, row {} the normal ({:.3f}, {:.3f}, {:.3f}) "
                                 "faces away from the camera",
                                 normals.file.string(), x, y, n[0], n[1], n[2])});
      return;
    }
}

}  // namespace

LabelCheck check_labels(const LabelSources& in, int index) {
  LabelCheck result;
  Label masks{in.layout.masks(index), {}}, depth{in.layout.depth(index), {}},
      normals{in.layout.normals(index), {}}, flow{in.layout.flow(index), {}};
  const bool has_masks = read_label(masks, read_image_as_stored, CV_8UC1, in.lens, result);
  const bool has_depth = read_label(depth, read_exr, CV_32FC1, in.lens, result);
  const bool has_normals = read_label(normals, read_normals, CV_32FC3, in.lens, result);
  const bool has_flow = static_cast<std::size_t>(index) + 1 < in.track.size() &&
                        read_label(flow, read_exr, CV_32FC2, in.lens, result);
  if (has_normals) check_facing(in.lens, normals, result);
  if (!has_masks) return result;
  if (has_depth && cv::countNonZero(masks.image & kMaskValid) > 0 &&
      !(cv::countNonZero(depth.image > 0.0) > 0)) {
    result.problems.push_back(
        {"no depth", fmt::format("{}: {}", depth.file.string(), depth_problem(depth.image))});
    return result;
  }
  if (has_depth)
    check_presence(
        depth, masks, kMaskValid, "depth",
        [&](int y, int x) {
          const float z = depth.image.at<float>(y, x);
          if (!std::isfinite(z)) return false;
          if (z > 0.0f) return true;
          // What a lens sees beyond a right angle lies at or behind the camera's plane.
          const auto ray = in.lens.unproject(Vec2(x + 0.5, y + 0.5));
          return ray && ray->z() <= 0.0;
        },
        result);
  if (has_normals)
    check_presence(
        normals, masks, kMaskValid, "normal",
        [&](int y, int x) { return std::isfinite(normals.image.at<cv::Vec3f>(y, x)[0]); }, result);
  if (!has_flow) return result;
  check_presence(
      flow, masks, kMaskFlowValid, "flow",
      [&](int y, int x) {
        const cv::Vec2f f = flow.image.at<cv::Vec2f>(y, x);
        return std::isfinite(f[0]) && std::isfinite(f[1]);
      },
      result);
  if (has_depth) check_flow(in, index, depth, flow, masks, result);
  return result;
}

}  // namespace rugae
