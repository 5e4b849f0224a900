#include "dataset/check_folder.h"

#include <fmt/ranges.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <map>
#include <opencv2/core.hpp>

#include "cameras/camera.h"
#include "core/check.h"
#include "dataset/diagnose.h"
#include "dataset/image_io.h"
#include "dataset/label_values.h"
#include "dataset/layout.h"
#include "dataset/manifest.h"
#include "dataset/problem_list.h"

namespace rugae {
namespace fs = std::filesystem;
namespace {

bool known(float depth_mm) { return std::isfinite(depth_mm) && depth_mm > 0.0f; }

std::string size_text(const cv::Mat& image) {
  return fmt::format("{} x {}", image.cols, image.rows);
}

// The first pixel at which a mask promises what the depth does not hold, if there are many.
std::string mask_problem(const cv::Mat& mask, const cv::Mat& depth_mm, const fs::path& depth) {
  std::size_t promised = 0, broken = 0;
  cv::Point first;
  for (int y = 0; y < mask.rows; ++y)
    for (int x = 0; x < mask.cols; ++x) {
      if (mask.at<unsigned char>(y, x) == 0) continue;
      ++promised;
      if (known(depth_mm.at<float>(y, x))) continue;
      if (broken++ == 0) first = {x, y};
    }
  constexpr double kBorders = 0.01;  // masks are drawn by hand and resized
  if (static_cast<double>(broken) <= kBorders * static_cast<double>(promised)) return {};
  return fmt::format(
      "marks {} of {} pixels as valid where {} has no depth, first at column {}, row {}", broken,
      promised, depth.string(), first.x, first.y);
}

class FolderChecker {
 public:
  FolderChecker(const fs::path& root, const PlainFolderOptions& options)
      : root_(root), folder_(PlainFolder::open(root, options)) {}

  DatasetCheck run() {
    result_.frames = static_cast<int>(folder_.image_files.size());
    result_.files = files_below(root_, "").size();
    if (fs::exists(DatasetLayout{root_}.manifest())) check_manifest(root_, problems_);
    if (folder_.calibration.empty())
      problems_.note(root_.string() +
                     ": no calibration; name it with --calibration (nothing can be led from frame "
                     "to frame without)");
    else
      lens_ = problems_.attempt([&] { return load_lens(folder_.calibration); });
    check_images();
    check_depths();
    check_flows();
    check_masks();
    check_poses();
    if (can_warp())
      warp();
    else if (problems_.none())
      note_what_lacks();
    result_.problems = problems_.take();
    return std::move(result_);
  }

 private:
  // Runs `look` on every file side by side; it returns what is wrong with the file or an empty
  // text. Lines that differ in the file's name alone are told once, with their number.
  template <typename Look>
  void each(const std::vector<fs::path>& files, Look&& look) {
    std::vector<std::string> found(files.size());
    tbb::parallel_for(std::size_t{0}, files.size(), [&](std::size_t i) {
      try {
        found[i] = look(i);
        if (!found[i].empty()) found[i] = ": " + found[i];
      } catch (const Error& error) {
        found[i] = error.what();
        if (found[i].starts_with(files[i].string())) found[i].erase(0, files[i].string().size());
      }
    });
    std::vector<std::pair<std::size_t, int>> kinds;  // the first file of each, and how many follow
    for (std::size_t i = 0; i < files.size(); ++i) {
      if (found[i].empty()) continue;
      const auto same = std::ranges::find_if(
          kinds, [&](const auto& kind) { return kind_of(found[kind.first]) == kind_of(found[i]); });
      if (same == kinds.end())
        kinds.emplace_back(i, 0);
      else
        ++same->second;
    }
    for (const auto& [first, more] : kinds)
      problems_.note(files[first].string() + found[first] +
                     (more == 0
                          ? std::string()
                          : fmt::format(" (and {} further file{})", more, more == 1 ? "" : "s")));
  }
  // A problem without its numbers.
  static std::string kind_of(std::string text) {
    std::erase_if(text, [](unsigned char c) { return std::isdigit(c) != 0 || c == '.'; });
    return text;
  }

  std::string size_problem(const cv::Mat& image) const {
    if (!lens_ || (image.cols == lens_->width && image.rows == lens_->height)) return {};
    return fmt::format("{} px, {} says {} x {}", size_text(image), folder_.calibration.string(),
                       lens_->width, lens_->height);
  }
  void check_count(const std::vector<fs::path>& files, const fs::path& folder, bool last_may_lack) {
    const std::size_t images = folder_.image_files.size();
    if (files.empty() || files.size() == images) return;
    if (last_may_lack && files.size() + 1 == images) return;
    problems_.note(fmt::format("{}: {} files for {} images{}", folder.string(), files.size(),
                               images, last_may_lack ? " (the last may have none)" : ""));
  }

  void check_images() {
    each(folder_.image_files,
         [&](std::size_t i) { return size_problem(read_image_bgr(folder_.image_files[i])); });
  }

  void check_depths() {
    check_count(folder_.depth_files, folder_.depth, false);
    each(folder_.depth_files, [&](std::size_t i) {
      const cv::Mat depth = folder_.depth_mm(i);
      const std::string size = size_problem(depth);
      return size.empty() ? depth_problem(depth) : size;
    });
  }

  void check_flows() {
    check_count(folder_.flow_files, folder_.flow, true);
    each(folder_.flow_files, [&](std::size_t i) {
      const cv::Mat flow = folder_.flow_px(i);
      const std::string size = size_problem(flow);
      if (!size.empty()) return size;
      const auto limit = clamped_at_px(flow);
      return limit ? fmt::format("the flow is clamped at {:g} px", *limit) : std::string();
    });
  }

  void check_masks() {
    check_count(folder_.mask_files, folder_.masks, false);
    const bool with_depth = folder_.mask_files.size() == folder_.depth_files.size();
    each(folder_.mask_files, [&](std::size_t i) {
      const cv::Mat mask = read_image_as_stored(folder_.mask_files[i]);
      if (mask.type() != CV_8UC1)
        return fmt::format("the mask is stored as {}, expected 8-bit of one channel",
                           cv::typeToString(mask.type()));
      const std::string size = size_problem(mask);
      if (!size.empty() || !with_depth) return size;
      cv::Mat depth;
      try {
        depth = folder_.depth_mm(i);
      } catch (const Error&) {  // told with the depths
        return std::string();
      }
      return depth.size() == mask.size() ? mask_problem(mask, depth, folder_.depth_files[i])
                                         : std::string();
    });
  }

  void check_poses() {
    if (folder_.poses.empty()) return;
    track_ = problems_.attempt([&] { return read_tum(folder_.poses); });
    if (!track_) return;
    if (track_->size() != folder_.image_files.size())
      problems_.note(fmt::format("{}: {} poses for {} images", folder_.poses.string(),
                                 track_->size(), folder_.image_files.size()));
    check_moves(*track_, folder_.poses.string(), problems_);
  }

  // Files that are broken by themselves were told; what they say of each other is not asked.
  bool can_warp() const {
    const std::size_t images = folder_.image_files.size();
    return lens_ && track_ && images >= 2 && problems_.none() && track_->size() == images &&
           folder_.depth_files.size() == images;
  }

  void note_what_lacks() {
    std::vector<std::string> lacks;
    if (folder_.depth_files.empty()) lacks.push_back("no folder of depth (--depth)");
    if (folder_.poses.empty()) lacks.push_back("no file of poses (--poses)");
    if (folder_.image_files.size() < 2) lacks.push_back("a single image");
    result_.notes.push_back(
        fmt::format("{}: nothing could be compared: {}", root_.string(), fmt::join(lacks, ", ")));
  }

  void warp() {
    WarpSequence sequence;
    sequence.lens = *lens_;
    for (const TimedPose& pose : *track_)
      sequence.world_from_camera.push_back(pose.world_from_camera);
    const auto at = [](int i) { return static_cast<std::size_t>(i); };
    sequence.read_gray = [&](int i) { return read_image_gray(folder_.image_files[at(i)]); };
    sequence.read_depth_mm = [&](int i) { return folder_.depth_mm(at(i)); };
    if (!folder_.flow_files.empty())
      sequence.read_flow_px = [&](int i) {
        return at(i) < folder_.flow_files.size() ? folder_.flow_px(at(i)) : cv::Mat();
      };
    const Diagnosis found = diagnose(sequence, {folder_.images.string(), folder_.depth.string(),
                                                folder_.poses.string(), folder_.flow.string()});
    for (const std::string& problem : found.problems) problems_.note(problem);
    result_.notes = found.notes;
    result_.worst_flow_px = found.flow_px;
  }

  fs::path root_;
  PlainFolder folder_;
  std::optional<Lens> lens_;
  std::optional<PoseTrack> track_;
  ProblemList problems_;
  DatasetCheck result_;
};

}  // namespace

DatasetCheck check_folder(const fs::path& root, const PlainFolderOptions& options) {
  return FolderChecker(root, options).run();
}

}  // namespace rugae
