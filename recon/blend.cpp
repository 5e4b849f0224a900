#include "recon/blend.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/core/ocl.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/stitching/detail/blenders.hpp>
#include <opencv2/stitching/detail/exposure_compensate.hpp>

#include "core/check.h"

namespace rugae {
namespace {

/// How much nearer to its border the anchor's pixel may lie and still win.
constexpr float kAnchorPreference = 6.0f;
/// Gains are means over overlaps: a smaller picture gives the same ones.
constexpr double kGainScale = 0.25;

/// The blender cuts each band to whole numbers: grey levels are fed this many times finer, which
/// 16 bits hold with their sign (one picture over five bands: 3 grey levels of error become 0.1).
constexpr double kBlendScale = 64.0;

/// The same bytes with and without a graphics card: OpenCV's OpenCL paths stay off in this thread.
class WithoutOpenCl {
 public:
  WithoutOpenCl() : was_(cv::ocl::useOpenCL()) { cv::ocl::setUseOpenCL(false); }
  ~WithoutOpenCl() { cv::ocl::setUseOpenCL(was_); }
  WithoutOpenCl(const WithoutOpenCl&) = delete;
  WithoutOpenCl& operator=(const WithoutOpenCl&) = delete;

 private:
  bool was_;
};

struct Warped {
  cv::Mat bgr, valid, weight;  // on the input's part of the canvas
  cv::Rect place;              // on the canvas
};

/// Whole plane pixels that hold the input's outline, within the bounds.
cv::Rect footprint(const BlendInput& input, const Eigen::AlignedBox2d& bounds) {
  const double width = input.bgr.cols, height = input.bgr.rows;
  Eigen::AlignedBox2d box;
  for (const Vec2& corner : {Vec2(0, 0), Vec2(width, 0), Vec2(width, height), Vec2(0, height)})
    box.extend(Vec2((input.plane_from_image * corner.homogeneous()).hnormalized()));
  box = box.intersection(bounds);
  if (box.isEmpty()) return {};
  const int left = static_cast<int>(std::floor(box.min().x()));
  const int top = static_cast<int>(std::floor(box.min().y()));
  const int right = static_cast<int>(std::ceil(box.max().x()));
  const int bottom = static_cast<int>(std::ceil(box.max().y()));
  return {left, top, right - left, bottom - top};
}

/// Distance of each known pixel from the border of what is known, px.
cv::Mat border_distance(const cv::Mat& valid) {
  cv::Mat padded, distance;
  cv::copyMakeBorder(valid, padded, 1, 1, 1, 1, cv::BORDER_CONSTANT, 0);
  cv::distanceTransform(padded, distance, cv::DIST_L2, cv::DIST_MASK_5);
  return distance(cv::Rect(1, 1, valid.cols, valid.rows)).clone();
}

/// `distance` is border_distance() of the input.
Warped warp(const BlendInput& input, const cv::Mat& distance, const cv::Rect& place, bool anchor) {
  // OpenCV's pixel centres are whole numbers: destination pixel d is plane pixel d + 0.5 + corner.
  Mat3 plane_from_cv = Mat3::Identity(), image_from_cv = Mat3::Identity();
  plane_from_cv(0, 2) = place.x + 0.5;
  plane_from_cv(1, 2) = place.y + 0.5;
  image_from_cv(0, 2) = image_from_cv(1, 2) = 0.5;
  const Mat3 h = plane_from_cv.inverse() * input.plane_from_image * image_from_cv;
  const cv::Matx33d to_canvas(h(0, 0), h(0, 1), h(0, 2), h(1, 0), h(1, 1), h(1, 2), h(2, 0),
                              h(2, 1), h(2, 2));
  Warped warped;
  warped.place = place;
  // The border is repeated so that blending across it finds colour, not black.
  cv::warpPerspective(input.bgr, warped.bgr, to_canvas, place.size(), cv::INTER_LINEAR,
                      cv::BORDER_REPLICATE);
  cv::warpPerspective(input.valid, warped.valid, to_canvas, place.size(), cv::INTER_LINEAR,
                      cv::BORDER_CONSTANT, 0);
  cv::threshold(warped.valid, warped.valid, 254, 255, cv::THRESH_BINARY);
  cv::warpPerspective(distance, warped.weight, to_canvas, place.size(), cv::INTER_LINEAR,
                      cv::BORDER_CONSTANT, 0);
  if (anchor) warped.weight *= kAnchorPreference;
  warped.weight.setTo(0.0f, warped.valid == 0);
  return warped;
}

cv::Mat choose_seams(const std::vector<Warped>& warped, cv::Size canvas) {
  cv::Mat seams(canvas, CV_32S, cv::Scalar(-1)), best = cv::Mat::zeros(canvas, CV_32F);
  for (std::size_t i = 0; i < warped.size(); ++i) {
    if (warped[i].place.empty()) continue;
    cv::Mat best_here = best(warped[i].place), seams_here = seams(warped[i].place);
    const cv::Mat wins = warped[i].weight > best_here;
    warped[i].weight.copyTo(best_here, wins);
    seams_here.setTo(static_cast<int>(i), wins);
  }
  return seams;
}

/// Brown and Lowe, IJCV 74 (2007) 59-73, section 6, doi:10.1007/s11263-006-0002-3.
std::vector<double> compensate_gains(std::vector<Warped>& warped) {
  std::vector<cv::Point> corners;
  std::vector<cv::UMat> images, masks;
  std::vector<std::size_t> owner;
  for (std::size_t i = 0; i < warped.size(); ++i) {
    if (warped[i].place.empty()) continue;
    // Corners and sizes on a common coarse grid, so that overlaps meet pixel by pixel.
    cv::Mat image, mask;
    const cv::Rect& place = warped[i].place;
    const cv::Point corner(cvFloor(place.x * kGainScale), cvFloor(place.y * kGainScale));
    const cv::Size size(std::max(1, cvRound(place.width * kGainScale)),
                        std::max(1, cvRound(place.height * kGainScale)));
    cv::resize(warped[i].bgr, image, size, 0, 0, cv::INTER_AREA);
    cv::resize(warped[i].valid, mask, size, 0, 0, cv::INTER_NEAREST);
    corners.push_back(corner);
    images.push_back(image.getUMat(cv::ACCESS_READ).clone());
    masks.push_back(mask.getUMat(cv::ACCESS_READ).clone());
    owner.push_back(i);
  }
  cv::detail::GainCompensator compensator(1);
  cv::detail::ExposureCompensator& compensate = compensator;  // whose feed takes plain masks
  compensate.feed(corners, images, masks);
  const std::vector<double> found = compensator.gains();
  std::vector<double> gains(warped.size(), 1.0);
  for (std::size_t k = 0; k < owner.size(); ++k) {
    gains[owner[k]] = found[k];
    warped[owner[k]].bgr.convertTo(warped[owner[k]].bgr, -1, found[k]);
  }
  return gains;
}

/// The picture with hard seams, which fills what an input does not know: a blend over wide bands
/// then finds true colour beyond an input's border. Outside all inputs: their borders repeated.
cv::Mat hard_composite(const std::vector<Warped>& warped, const cv::Mat& seams) {
  cv::Mat composite(seams.size(), CV_8UC3), filled = cv::Mat::zeros(seams.size(), CV_8U);
  for (const Warped& input : warped) {
    if (input.place.empty()) continue;
    cv::Mat here = composite(input.place), filled_here = filled(input.place);
    input.bgr.copyTo(here, filled_here == 0);
    filled_here.setTo(255);
  }
  composite.setTo(cv::mean(composite, filled), filled == 0);
  for (std::size_t i = 0; i < warped.size(); ++i) {
    if (warped[i].place.empty()) continue;
    cv::Mat here = composite(warped[i].place);
    warped[i].bgr.copyTo(here, seams(warped[i].place) == static_cast<int>(i));
  }
  return composite;
}

}  // namespace

BlendResult blend(const std::vector<BlendInput>& inputs, const Eigen::AlignedBox2d& bounds,
                  int bands) {
  check(!inputs.empty(), "blend: no pictures");
  const WithoutOpenCl guard;
  std::vector<cv::Rect> places;
  cv::Rect canvas;
  for (const BlendInput& input : inputs) {
    check(input.bgr.type() == CV_8UC3 && input.valid.type() == CV_8U &&
              input.bgr.size() == input.valid.size(),
          "blend: expected CV_8UC3 pictures with CV_8U masks of their size");
    places.push_back(footprint(input, bounds));
    if (places.back().empty()) continue;
    canvas = canvas.empty() ? places.back() : canvas | places.back();
  }
  check(!canvas.empty(), "blend: no picture lies on the canvas");
  std::vector<Warped> warped;
  cv::Mat distance;
  std::size_t distance_of = 0;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    if (places[i].empty()) {
      warped.emplace_back();
      continue;
    }
    // Frames of one camera share their mask.
    if (distance.empty() || inputs[i].valid.data != inputs[distance_of].valid.data) {
      distance = border_distance(inputs[i].valid);
      distance_of = i;
    }
    warped.push_back(warp(inputs[i], distance, places[i], i == 0));
    warped.back().place -= canvas.tl();
  }

  BlendResult result;
  result.origin_px = Vec2(canvas.x, canvas.y);
  result.gains = compensate_gains(warped);
  result.seams = choose_seams(warped, canvas.size());
  result.valid = result.seams >= 0;

  // Burt and Adelson, ACM TOG 2 (1983) 217-236, doi:10.1145/245.247.
  const cv::Mat composite = hard_composite(warped, result.seams);
  cv::detail::MultiBandBlender blender(false, bands);
  blender.prepare(cv::Rect({0, 0}, canvas.size()));
  const int reach = 1 << std::clamp(bands, 0, 10);  // of the widest band
  for (std::size_t i = 0; i < warped.size(); ++i) {
    if (warped[i].place.empty()) continue;
    const cv::Mat mine = result.seams == static_cast<int>(i);
    if (cv::countNonZero(mine(warped[i].place)) == 0) continue;
    const cv::Rect place = cv::Rect(warped[i].place.tl() - cv::Point(reach, reach),
                                    warped[i].place.size() + cv::Size(2 * reach, 2 * reach)) &
                           cv::Rect({0, 0}, canvas.size());
    cv::Mat whole = composite(place).clone(), wide;
    cv::Mat own = whole(warped[i].place - place.tl());
    warped[i].bgr.copyTo(own, warped[i].valid);
    whole.convertTo(wide, CV_16S, kBlendScale);
    blender.feed(wide, mine(place), place.tl());
  }
  cv::Mat blended, mask;
  blender.blend(blended, mask);
  blended.convertTo(result.bgr, CV_8U, 1.0 / kBlendScale);
  result.bgr.setTo(cv::Scalar::all(0), result.valid == 0);
  return result;
}

}  // namespace rugae
