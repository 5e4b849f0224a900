#pragma once
// Which way to read a sequence makes its files agree: medians of the disagreement, side by side.

#include <cstddef>
#include <vector>

namespace rugae {

/// Medians of a few readings over the same pairs of frames; the first reading is the files as
/// given.
struct Contest {
  static constexpr double kFewSamples = 60;  // fewer decide nothing

  std::vector<double> medians;
  std::vector<std::size_t> counts;

  explicit Contest(const std::vector<std::vector<double>>& errors);
  /// The first reading, other than as given, that is as good as the best of those with enough
  /// samples; 0 when none is clearly better than as given. Disagreements up to `sound` are those of
  /// sound files; an explanation may leave `most`.
  std::size_t winner(double sound, double most) const;
  double margin(std::size_t winner) const;
};

}  // namespace rugae
