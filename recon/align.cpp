#include "recon/align.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/random.h"
#include "recon/flow.h"
#include "recon/mask_at.h"
#include "recon/patch_align.h"
#include "recon/refine.h"

namespace rugae {
namespace {

constexpr double kReferenceWidthPx = 640.0;  // of the options in px
constexpr int kFlowWidthPx = 320;            // the flow is measured at about this width
constexpr double kRoundTripPx = 1.5;  // forward then backward flow must come back this near, at 640
constexpr double kMinTexture = 1e-6;  // smaller eigenvalue of the structure tensor, [0, 1] per px
constexpr double kMinInlierShare = 0.3;  // of the matches, on the first plane
constexpr int kMaxPlanes = 6;
constexpr double kLinearReachPx = 8.0;  // of the differences that give the flow's slope, at 640
constexpr int kBorderPx = 2;
constexpr double kSmoothingPx = 1.2;     // where noise hides the texture
constexpr double kMinCorrelation = 0.5;  // of large patches: the predicted deviation decides

struct Match {
  Vec2 reference_px, moving_px;
  Mat2 linear;     // d moving / d reference, from the flow
  int point = -1;  // its place in the list of points
};

// CV_8U: a patch around the pixel has no part of what a field stop made black, whose edge stands
// still. Where the image ends a patch is cut off.
cv::Mat patch_inside(const cv::Mat& valid, double radius_px) {
  const int side = 2 * static_cast<int>(std::ceil(radius_px)) + 1;
  cv::Mat inside;
  cv::erode(valid, inside, cv::getStructuringElement(cv::MORPH_ELLIPSE, {side, side}), {-1, -1}, 1,
            cv::BORDER_CONSTANT, cv::Scalar(255));
  return inside;
}

// CV_8U: wall whose look belongs to it, a pixel away from reflections and from the field's border.
cv::Mat usable_pixels(const Frame& frame) {
  cv::Mat usable = frame.valid & ~frame.reflection;
  cv::erode(usable, usable, cv::Mat::ones(3, 3, CV_8U));
  return usable;
}

// The most textured pixel of each cell: where the flow is measured best.
std::vector<Vec2> grid_points(const cv::Mat& gray, const cv::Mat& usable, int cell_px) {
  cv::Mat texture;
  cv::cornerMinEigenVal(gray, texture, 7, 3);
  std::vector<Vec2> points;
  for (int y0 = kBorderPx; y0 + cell_px + kBorderPx <= gray.rows; y0 += cell_px) {
    for (int x0 = kBorderPx; x0 + cell_px + kBorderPx <= gray.cols; x0 += cell_px) {
      float best = static_cast<float>(kMinTexture);
      int best_x = -1, best_y = -1;
      for (int y = y0; y < y0 + cell_px; ++y) {
        const auto* t = texture.ptr<float>(y);
        const auto* u = usable.ptr<unsigned char>(y);
        for (int x = x0; x < x0 + cell_px; ++x) {
          if (!u[x] || !(t[x] > best)) continue;
          best = t[x];
          best_x = x;
          best_y = y;
        }
      }
      if (best_x >= 0) points.emplace_back(best_x + 0.5, best_y + 0.5);
    }
  }
  return points;
}

// Bilinear; `p` in (0.5, 0.5) convention, held inside the image.
Vec2 sample_flow(const cv::Mat& flow, const Vec2& p) {
  const double x = std::clamp(p.x() - 0.5, 0.0, flow.cols - 1.001);
  const double y = std::clamp(p.y() - 0.5, 0.0, flow.rows - 1.001);
  const int ix = static_cast<int>(x), iy = static_cast<int>(y);
  const double fx = x - ix, fy = y - iy;
  const auto at = [&](int u, int v) {
    const cv::Vec2f& f = flow.at<cv::Vec2f>(v, u);
    return Vec2(f[0], f[1]);
  };
  return (1 - fy) * ((1 - fx) * at(ix, iy) + fx * at(ix + 1, iy)) +
         fy * ((1 - fx) * at(ix, iy + 1) + fx * at(ix + 1, iy + 1));
}

Mat3 from_cv(const cv::Mat& m) {
  Mat3 out;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) out(r, c) = m.at<double>(r, c);
  return out;
}

// The flow is measured on images this many times smaller; the rest of the division is cut off.
int flow_shrink(const cv::Mat& image) { return std::max(1, image.cols / kFlowWidthPx); }

cv::Mat shrunk(const cv::Mat& image) {
  const int shrink = flow_shrink(image);
  const cv::Size size(image.cols / shrink, image.rows / shrink);
  const cv::Rect whole(0, 0, size.width * shrink, size.height * shrink);
  cv::Mat small;
  cv::resize(image(whole), small, size, 0, 0, cv::INTER_AREA);
  return small;
}

// Matches that come back within the tolerance: forward flow at the points, backward flow at their
// images.
std::vector<Match> match(const AlignImage& reference, const AlignImage& moving,
                         const AlignOptions& options, double scale, const AlignGuess& guess) {
  const int shrink = flow_shrink(reference.gray);
  const auto [forward, backward] =
      guess.measured.forward.empty() ? measure_flow(reference, moving, guess.flow) : guess.measured;
  const cv::Mat &usable = reference.usable, &landing = moving.landing;
  const int cell_px = std::max(2, static_cast<int>(std::lround(options.grid_px * scale)));
  const std::vector<Vec2> points = guess.reference_points.empty()
                                       ? grid_points(reference.intensity, usable, cell_px)
                                       : guess.reference_points;
  std::vector<Match> matches;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec2& p = points[i];
    if (!mask_at(usable, p)) continue;
    const Vec2 q = p + shrink * sample_flow(forward, p / shrink);
    if (!mask_at(landing, q)) continue;
    const Vec2 back = q + shrink * sample_flow(backward, q / shrink);
    if (!((back - p).norm() <= kRoundTripPx * scale)) continue;
    Mat2 linear = Mat2::Identity();
    const double reach_px = kLinearReachPx * scale;
    for (int axis = 0; axis < 2; ++axis) {
      const Vec2 step = reach_px * Vec2::Unit(axis);
      linear.col(axis) +=
          (sample_flow(forward, (p + step) / shrink) - sample_flow(forward, (p - step) / shrink)) *
          (shrink / (2.0 * reach_px));
    }
    matches.push_back({p, q, linear, static_cast<int>(i)});
  }
  return matches;
}

// The homography ref from mov of the matches by RANSAC; its inliers move from `matches` to
// `inliers`.
std::optional<Mat3> take_homography(std::vector<Match>& matches, double threshold_px,
                                    int ransac_seed, std::vector<Match>& inliers) {
  std::vector<cv::Point2d> from, to;
  for (const Match& m : matches) {
    from.emplace_back(m.moving_px.x(), m.moving_px.y());
    to.emplace_back(m.reference_px.x(), m.reference_px.y());
  }
  cv::UsacParams ransac;
  ransac.confidence = 0.999;
  ransac.isParallel = false;  // its parallel form depends on the order of threads
  ransac.maxIterations = 2000;
  ransac.threshold = threshold_px;
  ransac.sampler = cv::SAMPLING_UNIFORM;
  ransac.score = cv::SCORE_METHOD_MSAC;
  ransac.loMethod = cv::LOCAL_OPTIM_INNER_LO;
  ransac.randomGeneratorState = ransac_seed;
  cv::Mat mask;
  const cv::Mat found = cv::findHomography(from, to, mask, ransac);
  if (found.empty() || mask.total() != matches.size()) return std::nullopt;
  const Mat3 h = from_cv(found);
  if (!h.allFinite() || !(std::abs(h.determinant()) > 1e-12)) return std::nullopt;
  inliers.clear();
  std::vector<Match> left;
  for (std::size_t i = 0; i < matches.size(); ++i)
    (mask.at<unsigned char>(static_cast<int>(i)) ? inliers : left).push_back(matches[i]);
  matches = std::move(left);
  return h;
}

// The inliers of one homography, each refined on its own patch of the paper's radius: on rendered
// frames it halves the flow's error, where a patch of half that radius takes off a quarter. Where
// the sharp patch does not fix the place the smoothed one is tried, at a third of its accuracy.
void refine(const AlignImage& reference, const AlignImage& moving,
            const std::vector<Match>& inliers, double radius_px, bool indexed,
            PairAlignment& result) {
  PointRefinementOptions options;
  options.radius_px = radius_px;
  options.min_correlation = kMinCorrelation;
  const PointRefiner refiner(options);
  std::vector<std::optional<Vec2>> refined(inliers.size());
  tbb::parallel_for(std::size_t{0}, inliers.size(), [&](std::size_t i) {
    const Match& m = inliers[i];
    const auto find = [&](const cv::Mat& from, const cv::Mat& in) {
      const auto sought = refiner.make_template(from, m.reference_px);
      return sought ? refiner(*sought, in, m.moving_px, m.linear) : std::nullopt;
    };
    refined[i] = find(reference.intensity, moving.intensity);
    if (!refined[i]) refined[i] = find(reference.smooth, moving.smooth);
  });
  for (std::size_t i = 0; i < inliers.size(); ++i) {
    if (!refined[i]) continue;
    result.reference_px.push_back(inliers[i].reference_px);
    result.moving_px.push_back(*refined[i]);
    if (indexed) result.point_index.push_back(inliers[i].point);
  }
}

// The affine over the patches at the inliers, started at their mean flow.
void fit(const AlignImage& reference, const AlignImage& moving, const std::vector<Match>& inliers,
         const AlignOptions& options, double scale, PairAlignment& result) {
  std::vector<Vec2> reference_px, moving_px;
  Vec2 mean_flow = Vec2::Zero();
  for (const Match& m : inliers) {
    reference_px.push_back(m.reference_px);
    moving_px.push_back(m.moving_px);
    mean_flow += (m.reference_px - m.moving_px) / static_cast<double>(inliers.size());
  }
  const double radius_px = options.patch_radius_px * scale;
  PatchPair pair{reference.intensity, moving.intensity, {}, {}};
  pair.reference_patches = circular_patches(reference_px, radius_px, pair.reference.size());
  pair.moving_patches = circular_patches(moving_px, radius_px, pair.moving.size());
  Affine2 start = Affine2::Identity();
  start.col(2) = mean_flow;
  const AffineFit found = fit_affine(pair, start, {options.stop_mse, options.max_iterations});
  result.ref_from_mov_affine = found.ref_from_mov;
  result.mse = found.mse;
  result.iterations = found.iterations;
  result.converged = found.converged;
}

}  // namespace

AlignField prepare_field(const cv::Mat& valid, const AlignOptions& options) {
  const double radius_px = options.patch_radius_px * valid.cols / kReferenceWidthPx;
  return {patch_inside(valid, radius_px), shrunk(valid) == 255};
}

AlignImage prepare_alignment(const Frame& frame, const AlignField& field) {
  AlignImage image;
  image.index = frame.index;
  image.gray = frame.gray;
  frame.gray.convertTo(image.intensity, CV_32F, 1.0 / 255.0);
  cv::GaussianBlur(image.intensity, image.smooth, {}, kSmoothingPx);
  image.landing = field.landing;
  image.usable = usable_pixels(frame) & field.landing;
  image.flow = prepare_flow(shrunk(frame.gray), field.flow_valid);
  return image;
}

PairFlow measure_flow(const AlignImage& reference, const AlignImage& moving, const cv::Mat& guess) {
  cv::Mat initial;
  if (!guess.empty()) initial = shrunk(guess) / flow_shrink(guess);
  PairFlow flow;
  const auto forward = [&] { flow.forward = farneback_flow(reference.flow, moving.flow, initial); };
  const auto backward = [&](const cv::Mat& start) {
    flow.backward = farneback_flow(moving.flow, reference.flow, start);
  };
  if (initial.empty()) {
    tbb::parallel_invoke(forward, [&] { backward({}); });
  } else {
    forward();
    backward(-flow.forward);
  }
  return flow;
}

std::optional<PairAlignment> align(const AlignImage& reference, const AlignImage& moving,
                                   const AlignOptions& options, std::uint64_t seed,
                                   const AlignGuess& guess) {
  const double scale = reference.gray.cols / kReferenceWidthPx;
  std::vector<Match> matches = match(reference, moving, options, scale, guess);
  const auto enough = static_cast<std::size_t>(options.min_inliers);

  PairAlignment result;
  result.reference = reference.index;
  result.moving = moving.index;
  result.matches = static_cast<int>(matches.size());
  for (int plane = 0; plane < kMaxPlanes && matches.size() >= enough; ++plane) {
    const auto word =
        random_words(seed, Purpose::recon_ransac, static_cast<std::uint32_t>(reference.index),
                     static_cast<std::uint64_t>(moving.index) * kMaxPlanes + plane);
    std::vector<Match> inliers;
    const std::optional<Mat3> h = take_homography(matches, options.ransac_threshold_px * scale,
                                                  static_cast<int>(word[0] >> 1), inliers);
    if (!h || inliers.size() < enough) break;
    if (plane == 0) {
      const double share = static_cast<double>(inliers.size()) / result.matches;
      if (!(share >= kMinInlierShare)) return std::nullopt;
      result.ref_from_mov_homography = *h;
      if (options.affine && guess.affine) fit(reference, moving, inliers, options, scale, result);
    }
    result.inliers += static_cast<int>(inliers.size());
    refine(reference, moving, inliers, options.patch_radius_px * scale,
           !guess.reference_points.empty(), result);
  }
  if (result.reference_px.size() < enough) return std::nullopt;
  return result;
}

std::optional<PairAlignment> align(const Frame& reference, const Frame& moving,
                                   const AlignOptions& options, std::uint64_t seed,
                                   const AlignGuess& guess) {
  return align(prepare_alignment(reference, prepare_field(reference.valid, options)),
               prepare_alignment(moving, prepare_field(moving.valid, options)), options, seed,
               guess);
}

}  // namespace rugae
