#pragma once
// A row of a picture that goes on to both sides.

#include <algorithm>
#include <vector>

namespace rugae {

/// A row with its ends repeated, so that the taps left and right of it exist.
class PaddedRow {
 public:
  PaddedRow(int width, int margin)
      : width_(width), margin_(margin), values_(width + 2 * static_cast<std::size_t>(margin)) {}
  float* begin() { return values_.data() + margin_; }
  void repeat_ends() {
    std::fill(values_.begin(), values_.begin() + margin_, values_[margin_]);
    std::fill(values_.end() - margin_, values_.end(), values_[margin_ + width_ - 1]);
  }

 private:
  int width_, margin_;
  std::vector<float> values_;
};

}  // namespace rugae
