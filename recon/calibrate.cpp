#include "recon/calibrate.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/core/eigen.hpp>

#include "core/check.h"
#include "dataset/image_io.h"
#include "dataset/observations.h"
#include "recon/chessboard.h"

namespace rugae {
namespace fs = std::filesystem;
namespace {

constexpr double kOutlierFactor = 3.0;  // of the median RMS error of a picture

// The models tried, simple ones first.
struct Candidate {
  const char* name;
  LensModel model;
  int radial;  // terms
  bool tangential;
};
constexpr Candidate kCandidates[] = {
    {"brown-conrady k1 k2", LensModel::brown_conrady, 2, false},
    {"brown-conrady k1 k2 p1 p2", LensModel::brown_conrady, 2, true},
    {"brown-conrady k1 k2 k3 p1 p2", LensModel::brown_conrady, 3, true},
    {"kannala-brandt k1 k2", LensModel::kannala_brandt, 2, false},
    {"kannala-brandt k1 k2 k3", LensModel::kannala_brandt, 3, false},
    {"kannala-brandt k1 k2 k3 k4", LensModel::kannala_brandt, 4, false},
};

// Board points and their pixels with integer centres, as OpenCV wants them.
struct Points {
  std::vector<std::vector<cv::Point3f>> board;
  std::vector<std::vector<cv::Point2f>> pixels;
};

Points points_of(const std::vector<CalibrationImage>& images, double square_mm) {
  Points points;
  for (const CalibrationImage& image : images) {
    if (!image.used) continue;
    std::vector<cv::Point3f> board;
    std::vector<cv::Point2f> pixels;
    for (int r = 0, i = 0; r < image.board.rows; ++r) {
      for (int c = 0; c < image.board.columns; ++c, ++i) {
        board.emplace_back(static_cast<float>(c * square_mm), static_cast<float>(r * square_mm),
                           0.0F);
        const Vec2& p = image.board.corners_px[static_cast<std::size_t>(i)];
        pixels.emplace_back(static_cast<float>(p.x() - 0.5), static_cast<float>(p.y() - 0.5));
      }
    }
    points.board.push_back(std::move(board));
    points.pixels.push_back(std::move(pixels));
  }
  return points;
}

struct Fit {
  Lens lens;
  std::vector<Rigid3> cam_from_board;  // of the used images
};

Fit to_fit(const cv::Matx33d& k, const Candidate& candidate, const cv::Mat& d,
           const std::vector<cv::Mat>& turns, const std::vector<cv::Mat>& shifts, int width,
           int height) {
  Fit fit;
  fit.lens.model = candidate.model;
  fit.lens.width = width;
  fit.lens.height = height;
  fit.lens.fx = k(0, 0);
  fit.lens.fy = k(1, 1);
  fit.lens.cx = k(0, 2) + 0.5;
  fit.lens.cy = k(1, 2) + 0.5;
  const auto at = [&](int i) { return i < static_cast<int>(d.total()) ? d.at<double>(i) : 0.0; };
  fit.lens.k1 = at(0);
  fit.lens.k2 = at(1);
  if (candidate.model == LensModel::brown_conrady) {
    fit.lens.p1 = at(2);
    fit.lens.p2 = at(3);
    fit.lens.k3 = at(4);
  } else {
    fit.lens.k3 = at(2);
    fit.lens.k4 = at(3);
  }
  for (std::size_t i = 0; i < turns.size(); ++i) {
    cv::Mat turn, shift;
    cv::Rodrigues(turns[i], turn);
    turn.convertTo(turn, CV_64F);
    shifts[i].convertTo(shift, CV_64F);
    Mat3 r;
    Vec3 t;
    cv::cv2eigen(turn, r);
    cv::cv2eigen(shift.reshape(1, 3), t);
    fit.cam_from_board.emplace_back(r, t);
  }
  return fit;
}

std::optional<Fit> fit(const Points& points, const Candidate& candidate, int width, int height) {
  // 90 degrees over the width, the principal point in the middle.
  cv::Matx33d k(0.5 * width, 0, 0.5 * width - 0.5, 0, 0.5 * width, 0.5 * height - 0.5, 0, 0, 1);
  const cv::TermCriteria stop(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 300, 1e-10);
  cv::Mat d;
  std::vector<cv::Mat> turns, shifts;
  try {
    if (candidate.model == LensModel::brown_conrady) {
      int flags = cv::CALIB_USE_INTRINSIC_GUESS;
      if (candidate.radial < 3) flags |= cv::CALIB_FIX_K3;
      if (!candidate.tangential) flags |= cv::CALIB_ZERO_TANGENT_DIST;
      d = cv::Mat::zeros(5, 1, CV_64F);
      cv::calibrateCamera(points.board, points.pixels, {width, height}, k, d, turns, shifts, flags,
                          stop);
    } else {
      int flags = cv::fisheye::CALIB_RECOMPUTE_EXTRINSIC | cv::fisheye::CALIB_FIX_SKEW |
                  cv::fisheye::CALIB_USE_INTRINSIC_GUESS;
      if (candidate.radial < 4) flags |= cv::fisheye::CALIB_FIX_K4;
      if (candidate.radial < 3) flags |= cv::fisheye::CALIB_FIX_K3;
      d = cv::Mat::zeros(4, 1, CV_64F);
      cv::fisheye::calibrate(points.board, points.pixels, {width, height}, k, d, turns, shifts,
                             flags, stop);
    }
  } catch (const cv::Exception&) {
    return std::nullopt;  // OpenCV's start did not lead anywhere
  }
  Fit result = to_fit(k, candidate, d, turns, shifts, width, height);
  for (const double value : {result.lens.fx, result.lens.fy, result.lens.cx, result.lens.cy,
                             result.lens.k1, result.lens.k2, result.lens.k3, result.lens.k4})
    if (!std::isfinite(value)) return std::nullopt;
  return result;
}

// Re-projection errors by our own lens, px; infinite where the lens does not see a corner.
std::vector<double> errors_px(const Lens& lens, const Rigid3& cam_from_board,
                              const BoardView& board, double square_mm) {
  std::vector<double> errors;
  for (int i = 0; i < board.rows * board.columns; ++i) {
    const Vec3 p(i % board.columns * square_mm, i / board.columns * square_mm, 0.0);
    const std::optional<Vec2> pixel = lens.project(cam_from_board * p);
    errors.push_back(pixel ? (*pixel - board.corners_px[static_cast<std::size_t>(i)]).norm()
                           : std::numeric_limits<double>::infinity());
  }
  return errors;
}

struct Errors {
  double mean_px = 0.0, rms_px = 0.0;
};

Errors summary(const std::vector<double>& errors) {
  Errors e;
  for (const double x : errors) {
    e.mean_px += x / static_cast<double>(errors.size());
    e.rms_px += x * x / static_cast<double>(errors.size());
  }
  e.rms_px = std::sqrt(e.rms_px);
  return e;
}

Errors summary(const std::vector<CalibrationImage>& images, const Fit& fit, double square_mm) {
  std::vector<double> all;
  std::size_t used = 0;
  for (const CalibrationImage& image : images) {
    if (!image.used) continue;
    const auto errors = errors_px(fit.lens, fit.cam_from_board[used++], image.board, square_mm);
    all.insert(all.end(), errors.begin(), errors.end());
  }
  return summary(all);
}

// What a model's terms must be worth: the Bayesian information criterion of Schwarz 1978,
// doi:10.1214/aos/1176344136,
//
//   n ln(RSS / n) + terms ln(n)
//
// of n coordinates, where the poses, alike for all models, are left out. The lowest wins.
double information(const Candidate& candidate, double rms_px, std::size_t coordinates) {
  const double n = static_cast<double>(coordinates);
  const double terms = candidate.radial + (candidate.tangential ? 2 : 0);
  return n * std::log(rms_px * rms_px) + terms * std::log(n);
}

struct Choice {
  std::optional<Fit> best;
  double information = 0.0;
  std::vector<ModelTrial> trials;
};

Choice choose(const std::vector<CalibrationImage>& images, int width, int height,
              const CalibrationOptions& options) {
  const Points points = points_of(images, options.square_mm);
  std::size_t coordinates = 0;
  for (const auto& pixels : points.pixels) coordinates += 2 * pixels.size();
  Choice choice;
  for (const Candidate& candidate : kCandidates) {
    if (options.model && *options.model != candidate.model) continue;
    ModelTrial trial;
    trial.name = candidate.name;
    const std::optional<Fit> found = fit(points, candidate, width, height);
    if (!found) {
      trial.refused = "did not converge";
      choice.trials.push_back(trial);
      continue;
    }
    trial.lens = found->lens;
    const Errors errors = summary(images, *found, options.square_mm);
    trial.mean_px = errors.mean_px;
    trial.rms_px = errors.rms_px;
    try {
      found->lens.check(candidate.name);
    } catch (const Error& error) {
      trial.refused = error.what();
    }
    if (!std::isfinite(errors.rms_px)) trial.refused = "does not see every corner";
    const double info = information(candidate, errors.rms_px, coordinates);
    if (trial.refused.empty() && (!choice.best || info < choice.information)) {
      choice.best = found;
      choice.information = info;
    }
    choice.trials.push_back(trial);
  }
  return choice;
}

int count_used(const std::vector<CalibrationImage>& images) {
  return static_cast<int>(
      std::count_if(images.begin(), images.end(), [](const auto& i) { return i.used; }));
}

// Fills the pictures' poses and errors; true when one was rejected.
bool judge(std::vector<CalibrationImage>& images, const Fit& fit,
           const CalibrationOptions& options) {
  std::vector<double> all;
  std::size_t used = 0;
  for (CalibrationImage& image : images) {
    if (!image.used) continue;
    image.cam_from_board = fit.cam_from_board[used++];
    const Errors e =
        summary(errors_px(fit.lens, image.cam_from_board, image.board, options.square_mm));
    image.mean_px = e.mean_px;
    image.rms_px = e.rms_px;
    all.push_back(e.rms_px);
  }
  std::nth_element(all.begin(), all.begin() + static_cast<long>(all.size() / 2), all.end());
  const double limit =
      std::min(options.max_image_error_px, kOutlierFactor * std::max(0.05, all[all.size() / 2]));
  // The worst alone: the others may fit well without it.
  CalibrationImage* worst = nullptr;
  for (CalibrationImage& image : images)
    if (image.used && !(image.rms_px <= limit) && (!worst || image.rms_px > worst->rms_px))
      worst = &image;
  if (!worst) return false;
  worst->used = false;
  worst->reason =
      fmt::format("re-projection error {:.2f} px is above {:.2f} px", worst->rms_px, limit);
  return true;
}

using BoardSize = std::pair<int, int>;

// How many pictures show which size.
std::map<BoardSize, int> count_sizes(const std::vector<cv::Mat>& grays) {
  std::vector<std::optional<BoardSize>> sizes(grays.size());
  tbb::parallel_for(std::size_t{0}, grays.size(),
                    [&](std::size_t i) { sizes[i] = find_board_size(grays[i]); });
  std::map<BoardSize, int> counts;
  for (const auto& size : sizes)
    if (size) ++counts[*size];
  return counts;
}

// To search for boards of any size takes ten times as long as for one of a known size, so a few
// pictures, spread over all, say what to look for: the largest board that most of them show. (In
// the others a part of it may have been seen.) Empty where that cannot be said.
std::optional<BoardSize> size_from_a_few(const std::vector<cv::Mat>& grays) {
  constexpr std::size_t kFew = 6;
  if (grays.size() <= 2 * kFew) return std::nullopt;
  std::vector<cv::Mat> few;
  for (std::size_t i = 0; i < kFew; ++i) few.push_back(grays[i * grays.size() / kFew]);
  std::vector<BoardSize> sizes;
  for (const auto& [size, count] : count_sizes(few)) sizes.push_back(size);
  std::sort(sizes.begin(), sizes.end(), [](const BoardSize& a, const BoardSize& b) {
    return a.first * a.second > b.first * b.second;
  });
  for (const BoardSize& size : sizes) {
    const auto shown = std::count_if(few.begin(), few.end(), [&](const cv::Mat& gray) {
      return shows_board(gray, size.first, size.second);
    });
    if (2 * static_cast<std::size_t>(shown) > kFew) return size;
  }
  return std::nullopt;
}

BoardSize board_size(const std::vector<cv::Mat>& grays) {
  if (const std::optional<BoardSize> size = size_from_a_few(grays)) return *size;
  const std::map<BoardSize, int> counts = count_sizes(grays);
  check(!counts.empty(), "calibration: no chessboard was found in {} pictures", grays.size());
  // Parts of the board have fewer corners: of equal votes the larger size holds.
  return std::max_element(counts.begin(), counts.end(),
                          [](const auto& a, const auto& b) { return a.second <= b.second; })
      ->first;
}

}  // namespace

void CalibrationOptions::check() const {
  rugae::check((columns == 0 && rows == 0) || (columns >= 3 && rows >= 3),
               "calibration: the board is {} x {} inner corners, expected at least 3 x 3, or 0 x 0 "
               "to search for it",
               columns, rows);
  rugae::check(square_mm > 0.0 && std::isfinite(square_mm),
               "calibration: square_mm is {}, expected above 0", square_mm);
  rugae::check(max_image_error_px > 0.0, "calibration: max_image_error_px is {}, expected above 0",
               max_image_error_px);
  rugae::check(min_images >= 2, "calibration: min_images is {}, expected at least 2", min_images);
}

std::vector<fs::path> pictures_in(const fs::path& folder_or_file) {
  check(fs::exists(folder_or_file), "{}: no such file or folder", folder_or_file.string());
  if (!fs::is_directory(folder_or_file)) return {folder_or_file};
  std::vector<fs::path> pictures;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_or_file)) {
    std::string extension = entry.path().extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (extension == ".png" || extension == ".jpg" || extension == ".jpeg" || extension == ".bmp")
      pictures.push_back(entry.path());
  }
  check(!pictures.empty(), "{}: holds no pictures (PNG, JPEG or BMP)", folder_or_file.string());
  std::sort(pictures.begin(), pictures.end(), [](const fs::path& a, const fs::path& b) {
    return natural_less(a.filename().string(), b.filename().string());
  });
  return pictures;
}

CalibrationResult calibrate_boards(std::vector<CalibrationImage> images, int width, int height,
                                   const CalibrationOptions& options) {
  options.check();
  const int found = count_used(images);
  check(found >= options.min_images,
        "calibration: the board was found in {} of {} pictures, expected at least {}", found,
        images.size(), options.min_images);
  Choice choice;
  do {
    choice = choose(images, width, height, options);
    check(choice.best.has_value(), "calibration: no lens model fits; {}: {}",
          choice.trials.back().name, choice.trials.back().refused);
  } while (judge(images, *choice.best, options) && count_used(images) >= options.min_images);
  check(count_used(images) >= options.min_images,
        "calibration: {} of {} pictures agree with one lens, expected at least {}",
        count_used(images), images.size(), options.min_images);

  CalibrationResult result;
  result.lens = choice.best->lens;
  const Errors errors = summary(images, *choice.best, options.square_mm);
  result.mean_px = errors.mean_px;
  result.rms_px = errors.rms_px;
  result.used = count_used(images);
  for (const CalibrationImage& image : images) {
    if (!image.used) continue;
    result.columns = image.board.columns;
    result.rows = image.board.rows;
  }
  result.images = std::move(images);
  result.trials = std::move(choice.trials);
  return result;
}

CalibrationResult calibrate(const std::vector<fs::path>& pictures,
                            const CalibrationOptions& options) {
  options.check();
  check(!pictures.empty(), "calibration: no pictures");
  std::vector<cv::Mat> grays;
  for (const fs::path& file : pictures) {
    grays.push_back(read_image_gray(file));
    check(grays.back().size() == grays.front().size(),
          "{}: is {} x {} px, but {} is {} x {}; one calibration needs one size", file.string(),
          grays.back().cols, grays.back().rows, pictures.front().string(), grays.front().cols,
          grays.front().rows);
  }
  BoardSize size(options.columns, options.rows);
  if (options.columns == 0) size = board_size(grays);
  std::vector<CalibrationImage> images(pictures.size());
  tbb::parallel_for(std::size_t{0}, pictures.size(), [&](std::size_t i) {
    images[i].file = pictures[i];
    std::optional<BoardView> board = find_board(grays[i], size.first, size.second);
    images[i].used = board.has_value();
    if (board)
      images[i].board = std::move(*board);
    else
      images[i].reason =
          fmt::format("no board of {} x {} inner corners found", size.first, size.second);
  });
  return calibrate_boards(std::move(images), grays.front().cols, grays.front().rows, options);
}

}  // namespace rugae
