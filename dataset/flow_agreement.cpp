#include "dataset/flow_agreement.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "core/check.h"
#include "dataset/check_labels.h"
#include "dataset/flow_explanations.h"
#include "dataset/image_io.h"
#include "dataset/label_values.h"
#include "dataset/moving_wall.h"
#include "dataset/warp.h"

namespace rugae {
namespace fs = std::filesystem;
namespace {

// Depth and flow are float32: at 100 mm and 100 px their last bits move a pixel by less than 1e-4.
// A label of the wrong frame of a slow capsule errs little but everywhere, hence the median's
// bound.
constexpr double kFlowAgreement_px = 0.01;
constexpr double kMedianAgreement_px = 0.001;
constexpr int kSamplesAcross = 24;  // of the grid on which depth, pose and flow are compared
constexpr double kInfinite = std::numeric_limits<double>::infinity();

// One pixel of the comparison: where it lies and its ray.
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

double middle_of(const std::vector<double>& sorted) { return sorted[sorted.size() / 2]; }

bool agree(const std::vector<double>& sorted) {
  return sorted.back() <= kFlowAgreement_px && middle_of(sorted) <= kMedianAgreement_px;
}

class Comparison {
 public:
  Comparison(const LabelSources& in, int index, const cv::Mat& depth_mm, const cv::Mat& flow_px,
             std::vector<Sample> samples)
      : in_(in),
        index_(index),
        frames_(static_cast<int>(in.track.size())),
        samples_(std::move(samples)),
        projector_(in.lens) {
    depths_[index] = depth_mm;
    flows_[index] = flow_px;
    if (!fs::exists(in.layout.wall_motion(index))) return;
    wall_.emplace(in.layout, *in.wall, frames_, index);
    if (fs::exists(in.layout.triangles(index)))
      triangles_ = read_exr(in.layout.triangles(index));
    else
      wall_->look_near(points({}, *rows(index)));
  }

  // Of every sample, px; infinite where the point cannot be seen. Sorted.
  std::vector<double> errors_px(const FilesReading& reading) {
    return errors_px(reading, false, samples_.size());
  }

  // In another frame some labels are not known, and where rounding decides what is seen they are
  // wrong: of a tenth of those that are known nothing is asked.
  bool fits(const FilesReading& reading) {
    std::vector<double> errors = errors_px(reading, true, samples_.size() / 10);
    if (2 * errors.size() < samples_.size()) return false;
    errors.resize((errors.size() * 9 + 9) / 10);
    return agree(errors);
  }

  // From now on any reading may be asked for.
  void look_everywhere() {
    if (wall_ && triangles_.empty()) wall_->look_everywhere();
  }

 private:
  // With `known`, of the samples whose labels are known. Gives up, without any errors, when more
  // than `may_fail` are too large.
  std::vector<double> errors_px(const FilesReading& reading, bool known, std::size_t may_fail) {
    const int to = index_ + reading.flow_to;
    const auto now = rows(index_ + reading.poses_of), next = rows(to + reading.poses_of);
    const cv::Mat depth = image(depths_, index_ + reading.depth_of, &DatasetLayout::depth),
                  flow = image(flows_, index_ + reading.flow_of, &DatasetLayout::flow);
    if (!now || !next || to < 0 || to >= frames_ || depth.empty() || flow.empty()) return {};
    const RowPoses from = read_as(*now, reading), other = read_as(*next, reading);
    std::vector<double> errors;
    std::size_t failed = 0;
    for (const Sample& sample : samples_) {
      if (known && (std::isnan(depth.at<float>(sample.y, sample.x)) ||
                    std::isnan(flow.at<cv::Vec2f>(sample.y, sample.x)[0])))
        continue;
      const double error = error_px(sample, from, other, to, depth, flow, reading);
      failed += error <= kFlowAgreement_px ? 0 : 1;
      if (failed > may_fail) return {};
      errors.push_back(error);
    }
    std::ranges::sort(errors);
    return errors;
  }

  double error_px(const Sample& sample, const RowPoses& now, const RowPoses& next, int to,
                  const cv::Mat& depth, const cv::Mat& flow, const FilesReading& reading) {
    const Vec3 point = lifted(sample, now, depth, reading);
    if (!point.allFinite()) return kInfinite;
    const double fps = in_.camera ? in_.camera->sensor.fps : 0.0;
    std::optional<Vec2> seen;
    if (!wall_) {
      seen = next.landing(
          projector_, [&](double) -> Vec3 { return point; }, sample.pixel.y());
    } else {
      const double then = index_ + reading.wall_of + fps * now.offset_s(sample.pixel.y());
      const WallPoint on = triangles_.empty() ? wall_->under(point, then) : labelled(sample);
      if (on.triangle < 0) return kInfinite;
      const Vec3 off = point - wall_->at(on, then);
      seen = next.landing(
          projector_,
          [&](double offset_s) -> Vec3 {
            return off + wall_->at(on, to + reading.wall_of + fps * offset_s);
          },
          sample.pixel.y());
    }
    if (!seen) return kInfinite;
    cv::Vec2f f = flow.at<cv::Vec2f>(sample.y, sample.x);
    if (reading.flow_swapped) std::swap(f[0], f[1]);
    const double error = (*seen - sample.pixel - reading.flow_sign * Vec2(f[0], f[1])).norm();
    return std::isfinite(error) ? error : kInfinite;
  }

  static Vec3 lifted(const Sample& sample, const RowPoses& rows, const cv::Mat& depth,
                     const FilesReading& reading) {
    const double depth_mm = reading.depth_factor * depth.at<float>(sample.y, sample.x);
    return rows.of_row(sample.y) *
           (sample.ray * (reading.kind == DepthKind::z ? depth_mm / sample.ray.z() : depth_mm));
  }
  std::vector<Vec3> points(const FilesReading& reading, const RowPoses& rows) {
    std::vector<Vec3> list;
    for (const Sample& sample : samples_)
      list.push_back(lifted(sample, rows, depths_.at(index_), reading));
    return list;
  }

  WallPoint labelled(const Sample& sample) const {
    const auto& on = triangles_.at<cv::Vec3f>(sample.y, sample.x);
    if (!(on[0] >= 0.0f && on[0] < static_cast<float>(in_.wall->triangles.size()))) return {};
    const double b1 = on[1], b2 = on[2];
    return {static_cast<int>(on[0]), Vec3(1.0 - b1 - b2, b1, b2)};
  }

  // Null outside the sequence.
  const RowPoses* rows(int frame) {
    if (frame < 0 || frame >= frames_) return nullptr;
    const auto found = rows_.find(frame);
    if (found != rows_.end()) return &found->second;
    const fs::path file = in_.layout.row_poses(frame);
    return &rows_
                .emplace(
                    frame,
                    fs::exists(file)
                        ? read_row_poses(file, *in_.camera)
                        : RowPoses(in_.track[static_cast<std::size_t>(frame)].world_from_camera))
                .first->second;
  }
  static RowPoses read_as(const RowPoses& rows, const FilesReading& reading) {
    if (!reading.pose) return rows;
    std::vector<Rigid3> poses;
    for (const Rigid3& pose : rows.poses()) poses.push_back(reading.pose(pose));
    return rows.rolling() ? RowPoses(std::move(poses), rows.row_time_s()) : RowPoses(poses[0]);
  }

  // Empty where there is none that can be read.
  const cv::Mat& image(std::map<int, cv::Mat>& images, int frame,
                       fs::path (DatasetLayout::*file)(int) const) {
    const auto [at, fresh] = images.try_emplace(frame);
    if (!fresh || frame < 0 || !fs::exists((in_.layout.*file)(frame))) return at->second;
    try {
      const cv::Mat read = read_exr((in_.layout.*file)(frame)), &like = images.at(index_);
      if (read.size() == like.size() && read.type() == like.type()) at->second = read;
    } catch (const Error&) {  // told of its own frame
    }
    return at->second;
  }

  const LabelSources& in_;
  int index_, frames_;
  std::vector<Sample> samples_;
  LensProjector projector_;
  std::optional<MovingWall> wall_;  // where it moves
  cv::Mat triangles_;               // where there are labels of them
  std::map<int, RowPoses> rows_;
  std::map<int, cv::Mat> depths_, flows_;
};

}  // namespace

FlowAgreement compare_flow(const LabelSources& in, int index, const cv::Mat& depth_mm,
                           const cv::Mat& flow_px, const cv::Mat& masks) {
  FlowAgreement result;
  result.index = index;
  std::vector<Sample> samples = sample_grid(in.lens, masks);
  if (samples.empty()) return result;
  Comparison comparison(in, index, depth_mm, flow_px, std::move(samples));
  const std::vector<double> errors = comparison.errors_px({});
  result.samples = errors.size();
  result.median_px = middle_of(errors);
  result.worst_px = errors.back();
  result.agrees = agree(errors);
  if (result.agrees || clamped_at_px(flow_px)) return result;
  comparison.look_everywhere();
  const std::vector<FlowExplanation>& all = flow_explanations();
  for (std::size_t i = 0; i < all.size(); ++i) {
    // two at once only where no single one will do
    if (all[i].two_at_once && !result.fits.empty()) break;
    if (std::ranges::any_of(all[i].readings,
                            [&](const FilesReading& reading) { return comparison.fits(reading); }))
      result.fits.push_back(static_cast<int>(i));
  }
  return result;
}

namespace {

// What holds for a sequence as a whole where no mistake of its parts explains it.
std::string left_over(const DatasetLayout& layout, const PoseTrack& track,
                      const FlowAgreement& frame) {
  if (const auto limit = clamped_at_px(read_exr(layout.flow(frame.index))))
    return fmt::format("the flow is clamped at {:g} px", *limit);
  constexpr double kSame_rad = 1e-6;
  const Quat& first = track[0].world_from_camera.rotation;
  if (std::ranges::all_of(track, [&first](const TimedPose& pose) {
        return angle_between_rad(pose.world_from_camera.rotation, first) <= kSame_rad;
      }))
    return "the rotation never changes";
  return "no usual mistake explains it, nor two at once";
}

}  // namespace

std::vector<std::string> tell_disagreements(const DatasetLayout& layout, const PoseTrack& track,
                                            const std::vector<FlowAgreement>& frames) {
  std::vector<const FlowAgreement*> left;
  for (const FlowAgreement& frame : frames)
    if (!frame.agrees) left.push_back(&frame);
  struct Told {
    const FlowAgreement* first;
    std::size_t frames;
    std::string text;
  };
  std::vector<Told> told;
  while (!left.empty()) {
    std::map<int, std::size_t> votes;
    for (const FlowAgreement* frame : left)
      for (const int explanation : frame->fits) ++votes[explanation];
    const auto most = std::ranges::max_element(
        votes, [](const auto& a, const auto& b) { return a.second < b.second; });
    const auto by_this = [&](const FlowAgreement* frame) {
      return most == votes.end() || std::ranges::count(frame->fits, most->first) > 0;
    };
    const FlowAgreement* first = *std::ranges::find_if(left, by_this);
    const std::string text = most == votes.end()
                                 ? left_over(layout, track, *first)
                                 : flow_explanations()[static_cast<std::size_t>(most->first)].text;
    told.push_back({first, static_cast<std::size_t>(std::erase_if(left, by_this)), text});
  }
  std::ranges::sort(told, {}, [](const Told& t) { return t.first->index; });
  std::vector<std::string> lines;
  for (const auto& [first, count, text] : told) {
    const std::size_t more = count - 1;
    lines.push_back(fmt::format(
        "{}: disagrees with depth and pose: median {:.3g} px, worst {:.3g} px over {} sampled "
        "pixels, expected at most {} and {} px; {}{}",
        layout.flow(first->index).string(), first->median_px, first->worst_px, first->samples,
        kMedianAgreement_px, kFlowAgreement_px, text,
        more == 0 ? "" : fmt::format(" (and in {} further frame{})", more, more == 1 ? "" : "s")));
  }
  return lines;
}

}  // namespace rugae
