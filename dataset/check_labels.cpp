#include "dataset/check_labels.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/core.hpp>
#include <optional>

#include "core/check.h"
#include "dataset/image_io.h"
#include "dataset/label_values.h"
#include "dataset/pose_mistakes.h"

namespace rugae {
namespace fs = std::filesystem;
namespace {

// Depth and flow are float32: at 100 mm and 100 px their last bits move a pixel by less than 1e-4.
// A label of the wrong frame of a slow capsule errs little but everywhere, hence the median's
// bound.
constexpr double kFlowAgreement_px = 0.01;
constexpr double kMedianAgreement_px = 0.001;
constexpr int kSamplesAcross = 24;  // of the grid on which depth, pose and flow are compared

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

// One pixel of the comparison: where it lies, its ray, and whether the flow is known there.
struct Sample {
  int x = 0, y = 0;
  Vec2 pixel;
  Vec3 ray;
};

std::vector<Sample> sample_grid(const Lens& lens, const cv::Mat& masks) {
  const int step = std::max(1, lens.width / kSamplesAcross);
  constexpr unsigned char kNeeded = kMaskValid | kMaskFlowValid;
  std::vector<Sample> samples;
  for (int y = step / 2; y < lens.height; y += step)
    for (int x = step / 2; x < lens.width; x += step) {
      if ((masks.at<unsigned char>(y, x) & kNeeded) != kNeeded) continue;
      const Vec2 pixel(x + 0.5, y + 0.5);
      if (const auto ray = lens.unproject(pixel)) samples.push_back({x, y, pixel, *ray});
    }
  return samples;
}

enum class DepthKind { z, range };

// For each sample: |project(next_from_this * (ray z / ray_z)) - pixel - sign flow|, px; infinite
// where the point cannot be seen. Sorted.
std::vector<double> disagreement_px(const std::vector<Sample>& samples, const Lens& lens,
                                    const cv::Mat& depth, const cv::Mat& flow,
                                    const Rigid3& next_from_this, double flow_sign = 1.0,
                                    DepthKind kind = DepthKind::z) {
  const LensProjector projector(lens);
  std::vector<double> errors;
  for (const Sample& sample : samples) {
    const double depth_mm = depth.at<float>(sample.y, sample.x);
    const Vec3 p_cam = sample.ray * (kind == DepthKind::z ? depth_mm / sample.ray.z() : depth_mm);
    const auto seen = projector.project(next_from_this * p_cam);
    const cv::Vec2f f = flow.at<cv::Vec2f>(sample.y, sample.x);
    const double error = seen ? (*seen - sample.pixel - flow_sign * Vec2(f[0], f[1])).norm() : NAN;
    errors.push_back(std::isfinite(error) ? error : std::numeric_limits<double>::infinity());
  }
  std::ranges::sort(errors);
  return errors;
}

// The wall between two frames: every vertex moves on a straight line at constant speed, and stands
// still before the first and after the last frame.
class MovingWall {
 public:
  MovingWall(const LabelSources& in, int index) {
    const int last = static_cast<int>(in.track.size()) - 1;
    for (int k = -1; k <= 1; ++k)
      walls_.push_back(moved_wall(*in.wall, in.layout.wall_motion(std::clamp(index + k, 0, last))));
  }
  // Not a number where the label names no triangle.
  Vec3 point(const cv::Vec3f& on_triangle, double beat) const {
    if (!(on_triangle[0] >= 0.0f &&
          on_triangle[0] < static_cast<float>(walls_[1].triangles.size())))
      return Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
    const Vec3i& t = walls_[1].triangles[static_cast<std::size_t>(on_triangle[0])];
    const double b1 = on_triangle[1], b2 = on_triangle[2], share = std::abs(beat);
    const auto corner = [&](int k) -> Vec3 {
      const auto v = static_cast<std::size_t>(t[k]);
      return (1.0 - share) * walls_[1].vertices[v] + share * walls_[beat < 0.0 ? 0 : 2].vertices[v];
    };
    return (1.0 - b1 - b2) * corner(0) + b1 * corner(1) + b2 * corner(2);
  }

 private:
  std::vector<TriangleMesh> walls_;
};

// The same where rows are exposed one after the other or the wall moves: the wall point is followed
// to the time at which the row it lands in is exposed. Empty where the wall moves and the files do
// not say on which triangle a pixel lies.
std::vector<double> disagreement_over_time_px(const LabelSources& in, int index,
                                              const std::vector<Sample>& samples,
                                              const cv::Mat& depth, const cv::Mat& flow) {
  const bool moves = fs::exists(in.layout.wall_motion(index));
  if (moves && !fs::exists(in.layout.triangles(index))) return {};
  const auto rows_of = [&](int frame) {
    const fs::path file = in.layout.row_poses(frame);
    return fs::exists(file) ? read_row_poses(file, *in.camera)
                            : RowPoses(in.track[static_cast<std::size_t>(frame)].world_from_camera);
  };
  const RowPoses now = rows_of(index), next = rows_of(index + 1);
  std::optional<MovingWall> wall_now, wall_next;
  cv::Mat triangles;
  if (moves) {
    wall_now.emplace(in, index);
    wall_next.emplace(in, index + 1);
    triangles = read_exr(in.layout.triangles(index));
  }
  const double fps = in.camera->sensor.fps;
  const LensProjector projector(in.lens);
  std::vector<double> errors;
  for (const Sample& sample : samples) {
    const double depth_mm = depth.at<float>(sample.y, sample.x);
    const Vec3 point = now.of_row(sample.y) * (sample.ray * (depth_mm / sample.ray.z()));
    const auto at = [&](double offset_s) -> Vec3 {
      if (!moves) return point;
      const auto& on = triangles.at<cv::Vec3f>(sample.y, sample.x);
      return point + (wall_next->point(on, fps * offset_s) -
                      wall_now->point(on, fps * now.offset_s(sample.pixel.y())));
    };
    const auto seen = next.landing(projector, at, sample.pixel.y());
    const cv::Vec2f f = flow.at<cv::Vec2f>(sample.y, sample.x);
    const double error = seen ? (*seen - sample.pixel - Vec2(f[0], f[1])).norm() : NAN;
    errors.push_back(std::isfinite(error) ? error : std::numeric_limits<double>::infinity());
  }
  std::ranges::sort(errors);
  return errors;
}

double median(const std::vector<double>& sorted) { return sorted[sorted.size() / 2]; }

bool agree(const std::vector<double>& sorted) {
  return sorted.back() <= kFlowAgreement_px && median(sorted) <= kMedianAgreement_px;
}

std::optional<cv::Mat> read_quietly(const fs::path& file, const cv::Mat& like) {
  if (!fs::exists(file)) return std::nullopt;
  try {
    cv::Mat image = read_exr(file);
    if (image.size() == like.size() && image.type() == like.type()) return image;
  } catch (const Error&) {
  }
  return std::nullopt;
}

// The common mistakes, each tried in place of what the dataset says.
std::string explanation(const LabelSources& in, int index, const std::vector<Sample>& samples,
                        const cv::Mat& depth, const cv::Mat& flow) {
  const auto at = static_cast<std::size_t>(index);
  const Rigid3 &now = in.track[at].world_from_camera, &next = in.track[at + 1].world_from_camera;
  const Rigid3 next_from_now = next.inverse() * now;
  const auto fits = [&](const cv::Mat& d, const cv::Mat& f, const Rigid3& motion, double sign = 1.0,
                        DepthKind kind = DepthKind::z) {
    auto errors = disagreement_px(samples, in.lens, d, f, motion, sign, kind);
    errors.resize((errors.size() * 9 + 9) / 10);  // in another frame some labels are not known
    return agree(errors);
  };
  if (const auto limit = clamped_at_px(flow))
    return fmt::format("; the flow is clamped at {:g} px", *limit);
  if (fits(depth, flow, next_from_now, -1.0)) return "; the flow's sign is flipped";
  if (fits(depth, flow, next_from_now, 1.0, DepthKind::range))
    return "; the depth is the distance along the ray, not along z";
  for (const PoseMistake& mistake : pose_mistakes())
    if (fits(depth, flow, mistake.undo(next).inverse() * mistake.undo(now)))
      return "; the poses are wrong: " + mistake.text;
  for (const int other : {index - 1, index + 1}) {
    if (other < 0) continue;
    if (const auto d = read_quietly(in.layout.depth(other), depth))
      if (fits(*d, flow, next_from_now))
        return fmt::format("; the depth of frame {} fits: depth is shifted by one frame", other);
    if (const auto f = read_quietly(in.layout.flow(other), flow))
      if (fits(depth, *f, next_from_now))
        return fmt::format("; the flow of frame {} fits: flow is shifted by one frame", other);
    const auto o = static_cast<std::size_t>(other);
    if (o + 1 < in.track.size() &&
        fits(depth, flow,
             in.track[o + 1].world_from_camera.inverse() * in.track[o].world_from_camera))
      return fmt::format("; the poses of frame {} fit: poses are shifted by one frame", other);
  }
  constexpr double kSame_rad = 1e-6;
  const Quat& first = in.track[0].world_from_camera.rotation;
  if (std::ranges::all_of(in.track, [&first](const TimedPose& pose) {
        return angle_between_rad(pose.world_from_camera.rotation, first) <= kSame_rad;
      }))
    return "; the rotation never changes";
  return {};
}

void check_flow(const LabelSources& in, int index, const Label& depth, const Label& flow,
                const Label& masks, LabelCheck& result) {
  const auto samples = sample_grid(in.lens, masks.image);
  if (samples.empty()) return;
  const auto at = static_cast<std::size_t>(index);
  const Rigid3 next_from_this =
      in.track[at + 1].world_from_camera.inverse() * in.track[at].world_from_camera;
  const bool over_time =
      fs::exists(in.layout.row_poses(index)) || fs::exists(in.layout.wall_motion(index));
  std::vector<double> errors;
  try {
    errors = over_time ? disagreement_over_time_px(in, index, samples, depth.image, flow.image)
                       : disagreement_px(samples, in.lens, depth.image, flow.image, next_from_this);
  } catch (const Error& error) {
    result.problems.push_back({"unreadable", error.what()});
  }
  if (errors.empty()) return;
  result.worst_flow_px = errors.back();
  result.flow_samples = errors.size();
  if (agree(errors)) return;
  result.problems.push_back(
      {"flow",
       fmt::format("{}: disagrees with depth and pose: median {:.3g} px, worst {:.3g} px "
                   "over {} sampled pixels, expected at most {} and {} px{}",
                   flow.file.string(), median(errors), errors.back(), errors.size(),
                   kMedianAgreement_px, kFlowAgreement_px,
                   over_time ? "" : explanation(in, index, samples, depth.image, flow.image))});
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
          return std::isfinite(z) && z > 0.0f;
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
