#include "recon/dense/light_sights.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/srgb.h"
#include "recon/dense/moving_keyframes.h"
#include "recon/masked_blur.h"
#include "recon/preprocess/reflections.h"

namespace rugae {
namespace {

constexpr double kReferenceWidthPx = 640.0;
constexpr double kSigmaPx = 2.5;       // of the mean around a place, at 640 px width
constexpr double kReflectionPx = 6.0;  // around a reflection its skirt is in the light, likewise
constexpr int kSaturated = 250;        // levels: the curve's end
constexpr int kDarkest = 20;           // levels: below, rounding weighs more than the wall
constexpr double kMinCosine = 0.4;     // of incidence: more oblique, normals are too uncertain
constexpr int kRed = 2;                // of BGR
constexpr std::size_t kAtOnce = 16;    // key frames held at a time

// Linear light around each pixel, 0 where nothing can be said.
cv::Mat light_of(const cv::Mat& bgr, const ReflectionOptions& reflections, const cv::Mat& field) {
  const double scale = bgr.cols / kReferenceWidthPx;
  cv::Mat gray, red, linear, table(1, 256, CV_32F);
  cv::cvtColor(bgr, gray, cv::COLOR_BGR2GRAY);
  cv::extractChannel(bgr, red, kRed);
  for (int level = 0; level < 256; ++level)
    table.at<float>(level) = static_cast<float>(linear_from_srgb(level / 255.0));
  cv::LUT(red, table, linear);
  const int side = 1 + 2 * std::max(1, static_cast<int>(std::lround(kReflectionPx * scale)));
  cv::Mat bad = detect_reflections(gray, reflections, field) | (red >= kSaturated);
  cv::dilate(bad, bad, cv::getStructuringElement(cv::MORPH_ELLIPSE, {side, side}));
  return masked_blur(linear, field & ~bad & (red >= kDarkest), kSigmaPx * scale);
}

}  // namespace

std::vector<LightSight> light_sights(const FrameSource& frames, const Structure& structure,
                                     const std::vector<WallPatch>& patches,
                                     const ReflectionOptions& reflections) {
  const std::size_t n = structure.frames.size();
  std::vector<std::vector<std::size_t>> seen(n);  // patches, of each key frame
  for (std::size_t p = 0; p < patches.size(); ++p)
    for (const Track::Observation& o :
         structure.tracks[static_cast<std::size_t>(patches[p].track)].observations)
      seen[static_cast<std::size_t>(o.keyframe)].push_back(p);
  const RollingShutter& shutter = frames.shutter();
  const Lens& lens = shutter.original();
  const double half_diagonal_px = 0.5 * std::hypot(lens.width, lens.height);
  const std::vector<CameraMotion> motions = keyframe_motions(frames, structure);
  std::vector<std::vector<LightSight>> found(n);
  for (std::size_t begin = 0; begin < n; begin += kAtOnce) {
    tbb::parallel_for(begin, std::min(n, begin + kAtOnce), [&](std::size_t k) {
      if (seen[k].empty()) return;
      const cv::Mat light =
          light_of(frames.observations().image(structure.frames[k]), reflections, frames.field());
      const Rigid3& pose = structure.cam_from_world[k];
      for (const std::size_t p : seen[k]) {
        const WallPatch& patch = patches[p];
        const auto p_cam = shutter.when_seen(pose * patch.centre, motions[k]);
        const auto pixel = p_cam ? shutter.project_original(*p_cam) : std::nullopt;
        if (!pixel || !lens.contains(*pixel)) continue;
        const double level =
            light.at<float>(static_cast<int>(pixel->y()), static_cast<int>(pixel->x()));
        const Vec3 normal_cam = pose.rotation * patch.normal;
        if (!(level > 0.0) || !(-normal_cam.dot(p_cam->normalized()) >= kMinCosine)) continue;
        const Vec2 off_axis = (*pixel - Vec2(lens.cx, lens.cy)) / half_diagonal_px;
        const Vec3 tangent = patch.normal.unitOrthogonal();
        found[k].push_back({patch.track, static_cast<int>(k), std::log(level), *p_cam, normal_cam,
                            pose.rotation * tangent, pose.rotation * patch.normal.cross(tangent),
                            patch.normal_sigma_rad, off_axis});
      }
    });
  }
  std::vector<LightSight> sights;
  for (const std::vector<LightSight>& of_frame : found)
    sights.insert(sights.end(), of_frame.begin(), of_frame.end());
  std::ranges::stable_sort(sights, {}, &LightSight::track);
  return sights;
}

}  // namespace rugae
