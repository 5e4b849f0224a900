#pragma once
// The exact place of a corner of a chessboard, from the picture around it.

#include <opencv2/core/mat.hpp>
#include <optional>

#include "core/types.h"

namespace rugae {

/// A corner as it was found, (0.5, 0.5) convention.
struct CornerGuess {
  Vec2 pixel;               // off by a pixel or two at most
  Vec2 across_px, down_px;  // along the two lines that meet in it, to the next corner
};

/// Fits the picture of four squares, two of them white, to all pixels within half the way to the
/// next corner. With the distances d1, d2 from the two lines through the corner, tanh(d1 / w)
/// tanh(d2 / w) is 1 or -1 on the squares and passes over their edges; e is its mean over a pixel's
/// area, and the linear light
///
///   (1 + g . x) (m + c e + q e^2)
///
/// with the slope g of the illumination. q takes up what is left of the tone curve (the picture is
/// taken for sRGB), by which a pixel that is half white is not half bright. All of it is symmetric
/// about the corner, so neither exposure nor gamma move it. cv::cornerSubPix, which knows edges by
/// their gradient alone, is off by 0.05 to 0.1 px on sharp edges; this by 0.01 to 0.02.
///
/// `gray` is CV_8U. Empty when the fit fails or leads farther away than `most_px`: squares that are
/// saturated, dark or hidden.
std::optional<Vec2> fit_corner(const cv::Mat& gray, const CornerGuess& guess, double most_px);

}  // namespace rugae
