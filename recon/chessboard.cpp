#include "recon/chessboard.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "recon/corner_fit.h"

namespace rugae {
namespace {

enum class Look { plain, flattened, local_contrast };
enum class Finder { squares, saddles };  // OpenCV's two: from dark squares, from saddle points

struct Attempt {
  Finder finder;
  Look look;
  double width_px;  // the picture is resized to about this width
};
// In the order of how often each finds the board in small capsule pictures, but for the first: with
// the light divided out, squares are found in a hundredth of the time that saddle points take.
constexpr std::array<Attempt, 16> kAttempts{{{Finder::squares, Look::flattened, 640},
                                             {Finder::saddles, Look::plain, 640},
                                             {Finder::saddles, Look::flattened, 640},
                                             {Finder::saddles, Look::local_contrast, 640},
                                             {Finder::saddles, Look::plain, 320},
                                             {Finder::saddles, Look::flattened, 320},
                                             {Finder::saddles, Look::local_contrast, 320},
                                             {Finder::saddles, Look::flattened, 960},
                                             {Finder::saddles, Look::plain, 960},
                                             {Finder::squares, Look::plain, 640},
                                             {Finder::squares, Look::local_contrast, 640},
                                             {Finder::squares, Look::plain, 320},
                                             {Finder::squares, Look::flattened, 320},
                                             {Finder::squares, Look::local_contrast, 320},
                                             {Finder::squares, Look::flattened, 960},
                                             {Finder::squares, Look::plain, 960}}};
constexpr double kMaxZoom = 4.0;
constexpr int kSmallestBoard = 3;  // inner corners a side

cv::Mat prepare(const cv::Mat& gray, Look look, double zoom) {
  cv::Mat image;
  cv::resize(gray, image, {}, zoom, zoom, zoom < 1.0 ? cv::INTER_AREA : cv::INTER_CUBIC);
  if (look == Look::flattened) {
    // Divided by its wide blur: the light falls off slowly, the squares do not.
    cv::Mat value, blurred;
    image.convertTo(value, CV_32F);
    cv::GaussianBlur(value, blurred, {}, image.cols / 25.0);
    const cv::Mat ratio = value / (blurred + 4.0);
    ratio.convertTo(image, CV_8U, 110.0);
  } else if (look == Look::local_contrast) {
    cv::createCLAHE(3.0, {4, 4})->apply(image, image);
  }
  return image;
}

double shortest_spacing(const std::vector<cv::Point2f>& corners, int columns) {
  double shortest = 1e9;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const bool last = (i + 1) % static_cast<std::size_t>(columns) == 0;
    if (!last) shortest = std::min(shortest, cv::norm(corners[i + 1] - corners[i]));
    if (i + static_cast<std::size_t>(columns) < corners.size())
      shortest =
          std::min(shortest, cv::norm(corners[i + static_cast<std::size_t>(columns)] - corners[i]));
  }
  return shortest;
}

// Twice the signed area of the outer corners' quadrangle: positive when the board's axes run as
// the image's.
double signed_area(const std::vector<cv::Point2f>& c, int columns) {
  const cv::Point2f &a = c.front(), &b = c[static_cast<std::size_t>(columns) - 1], &d = c.back(),
                    &e = c[c.size() - static_cast<std::size_t>(columns)];
  return (d - a).cross(e - b);
}

// From the corner's neighbours on the board, so along its edges in the picture.
CornerGuess guess_of(const std::vector<cv::Point2f>& corners, int columns, int rows, int i) {
  const int c = i % columns, r = i / columns;
  const auto at = [&](int column, int row) {
    const cv::Point2f& p = corners[static_cast<std::size_t>(row * columns + column)];
    return Vec2(p.x + 0.5, p.y + 0.5);
  };
  // The direction from one neighbour to the other, as long as the shorter way.
  const auto along = [](const Vec2& before, const Vec2& here, const Vec2& after) -> Vec2 {
    const double back = (here - before).norm(), forth = (after - here).norm();
    const double length = back > 0.0 && forth > 0.0 ? std::min(back, forth) : back + forth;
    return length * (after - before).normalized();
  };
  const Vec2 here = at(c, r);
  return {here, along(at(std::max(c - 1, 0), r), here, at(std::min(c + 1, columns - 1), r)),
          along(at(c, std::max(r - 1, 0)), here, at(c, std::min(r + 1, rows - 1)))};
}

struct Refined {
  BoardView view;
  bool whole = true;  // every corner was fitted, none is left where the finder put it
};

Refined refine(const cv::Mat& gray, std::vector<cv::Point2f> corners, double zoom, int columns,
               int rows) {
  // resize() maps pixel areas: (x + 0.5) = (X + 0.5) / zoom.
  for (cv::Point2f& c : corners) {
    c.x = static_cast<float>((c.x + 0.5) / zoom - 0.5);
    c.y = static_cast<float>((c.y + 0.5) / zoom - 0.5);
  }
  // The window stays inside the four squares around a corner.
  const int half = std::clamp(static_cast<int>(0.35 * shortest_spacing(corners, columns)), 2, 11);
  std::vector<cv::Point2f> refined = corners;
  cv::cornerSubPix(gray, refined, {half, half}, {-1, -1},
                   {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 50, 1e-3});
  for (std::size_t i = 0; i < corners.size(); ++i) {
    // A saturated or dark square next to a corner leads the refinement astray.
    if (cv::norm(refined[i] - corners[i]) <= 0.5 * half) corners[i] = refined[i];
  }
  if (signed_area(corners, columns) < 0.0) {
    for (int r = 0; r < rows; ++r)
      std::reverse(corners.begin() + r * columns, corners.begin() + (r + 1) * columns);
  }
  Refined board;
  board.view.columns = columns;
  board.view.rows = rows;
  constexpr double kMostShift_px = 1.0;
  for (int i = 0; i < columns * rows; ++i) {
    const CornerGuess guess = guess_of(corners, columns, rows, i);
    const std::optional<Vec2> fitted = fit_corner(gray, guess, kMostShift_px);
    board.whole &= fitted.has_value();
    board.view.corners_px.push_back(fitted.value_or(guess.pixel));
  }
  return board;
}

double zoom_of(const Attempt& attempt, const cv::Mat& gray) {
  return std::min(kMaxZoom, attempt.width_px / gray.cols);
}

bool find_corners(Finder finder, const cv::Mat& image, cv::Size size,
                  std::vector<cv::Point2f>& corners) {
  if (finder == Finder::squares)
    return cv::findChessboardCorners(image, size, corners,
                                     cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE);
  return cv::findChessboardCornersSB(
      image, size, corners,
      cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_EXHAUSTIVE | cv::CALIB_CB_ACCURACY);
}

}  // namespace

std::optional<BoardView> find_board(const cv::Mat& gray, int columns, int rows) {
  for (const Attempt& attempt : kAttempts) {
    const double zoom = zoom_of(attempt, gray);
    std::vector<cv::Point2f> corners;
    if (!find_corners(attempt.finder, prepare(gray, attempt.look, zoom), {columns, rows}, corners))
      continue;
    Refined found = refine(gray, std::move(corners), zoom, columns, rows);
    // What squares give is less exact than saddle points: good only where it was refined.
    const bool rough = &attempt == &kAttempts.front();
    if (found.whole || !rough) return std::move(found.view);
  }
  return std::nullopt;
}

bool shows_board(const cv::Mat& gray, int columns, int rows) {
  const Attempt& quick = kAttempts.front();
  std::vector<cv::Point2f> corners;
  return find_corners(quick.finder, prepare(gray, quick.look, zoom_of(quick, gray)),
                      {columns, rows}, corners);
}

std::optional<std::pair<int, int>> find_board_size(const cv::Mat& gray) {
  std::pair<int, int> largest(0, 0);
  for (const Attempt& attempt : kAttempts) {
    if (attempt.finder != Finder::saddles) continue;  // the other one wants to know the size
    const cv::Mat image = prepare(gray, attempt.look, zoom_of(attempt, gray));
    // A seed of 3 x 3 corners may grow along one axis alone: the larger seed is tried as well.
    for (const int seed : {kSmallestBoard + 1, kSmallestBoard}) {
      std::vector<cv::Point2f> corners;
      cv::Mat meta;
      if (!cv::findChessboardCornersSB(image, {seed, seed}, corners,
                                       cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_LARGER, meta))
        continue;
      const std::pair<int, int> size(std::max(meta.cols, meta.rows),
                                     std::min(meta.cols, meta.rows));
      if (size.first * size.second > largest.first * largest.second) largest = size;
    }
    if (attempt.width_px < 640 && largest.second >= kSmallestBoard) break;
  }
  if (largest.second < kSmallestBoard) return std::nullopt;
  return largest;
}

}  // namespace rugae
