#pragma once
// The inner corners of a chessboard in one picture.

#include <opencv2/core/mat.hpp>
#include <optional>
#include <utility>

#include "recon/calibrate.h"

namespace rugae {

/// Finds a board of columns x rows inner corners in a CV_8U picture. Capsule pictures are small,
/// dark at the borders and saturated in the middle: the picture is tried at several sizes, as it
/// is, with its illumination divided out, and with local contrast (CLAHE); by the radon-like
/// detector of Duda and Frese (BMVC 2018), then by the classic one of dark squares. Corners are
/// refined on the picture itself. Where the classic detector finds the board at once and every
/// corner could be refined, that is the result: the same corners in a hundredth of the time.
std::optional<BoardView> find_board(const cv::Mat& gray, int columns, int rows);

/// Whether a board of that size is seen at a quick look; `find_board` may find one all the same.
bool shows_board(const cv::Mat& gray, int columns, int rows);

/// The size (columns, rows) of the board in the picture, the larger number first; empty when no
/// board is seen. A part of a board that hides its borders is reported as that part.
std::optional<std::pair<int, int>> find_board_size(const cv::Mat& gray);

}  // namespace rugae
