#pragma once
// Do two images show the same things, wherever in the image they lie?

#include <opencv2/core/mat.hpp>

namespace rugae {

/// Share of the textured patches of `image` that are found in `other` within a quarter of its
/// width, 0 to 1, by the correlation of what is left when brightness that varies slowly is taken
/// off. -1 where too few patches have texture. CV_8U, of the same size.
double found_again(const cv::Mat& image, const cv::Mat& other);

}  // namespace rugae
