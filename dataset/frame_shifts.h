#pragma once
// Files that are one frame off against each other.

#include <string>
#include <vector>

#include "dataset/evidence.h"

namespace rugae {

/// Lines on depth, poses or colour that belong to the frame before or the next.
std::vector<std::string> frame_shifts(Evidence& e, const Reading& reading);
/// The same for colour alone, where depth and poses agree.
std::vector<std::string> colour_shift(Evidence& e, const Reading& reading);

}  // namespace rugae
