#pragma once
// What the frames of a dataset see of its wall.

#include <vector>

#include "core/progress.h"
#include "dataset/truth.h"
#include "validate/visibility.h"

namespace rugae {

/// By their true depth, which is read side by side; the visibility keeps a reference to the truth's
/// wall.
Visibility wall_seen(const Truth& truth, const std::vector<int>& frames, Progress& progress);

}  // namespace rugae
