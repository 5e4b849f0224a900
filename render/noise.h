#pragma once
// Random numbers of a sensor from uniform words: normal by table, Poisson exactly at low counts.
// Built from + - * / and sqrt alone, so every machine draws the same.

#include <bit>
#include <cstdint>
#include <vector>

namespace rugae {

/// The quantile function of the standard normal distribution over 32-bit words, to 1e-6. The tails
/// shrink by octaves, each octave of the tail probability has 16 cubic pieces (hierarchical
/// segmentation: Lee et al., A hardware Gaussian noise generator, IEEE Trans. Comput. 2006,
/// doi:10.1109/TC.2006.81).
class NormalTable {
 public:
  NormalTable();

  float operator()(std::uint32_t word) const {
    const std::uint32_t tail = word & 0x7fffffffu;  // probability (tail + 0.5) / 2^32, below half
    const float z = quantile(tail);
    return word >> 31 ? z : -z;
  }

 private:
  static constexpr int kSplit = 4;  // an octave has 2^4 pieces
  static constexpr int kFirst = 1 << kSplit;
  struct Piece {
    float c0, c1, c2, c3;
  };

  // How far out, in standard deviations, the tail of that probability begins.
  float quantile(std::uint32_t tail) const {
    if (tail < kFirst) return pieces_[tail].c0;
    const int shift = std::bit_width(tail) - 1 - kSplit;
    const Piece& p = pieces_[(shift << kSplit) + (tail >> shift)];
    const float t = static_cast<float>(static_cast<int>(tail & ((1u << shift) - 1u))) *
                    std::bit_cast<float>((127u - static_cast<unsigned>(shift)) << 23);
    return p.c0 + t * (p.c1 + t * (p.c2 + t * p.c3));
  }

  std::vector<Piece> pieces_;
};

/// Number of events of mean `mean` by inversion of the distribution function: exact below
/// kExactBelow, where the mean's whole and fractional parts are drawn by a word each.
class PoissonTable {
 public:
  static constexpr int kExactBelow = 64;

  PoissonTable();
  int operator()(double mean, std::uint32_t whole_word, std::uint32_t fraction_word) const;

 private:
  std::vector<std::vector<double>> below_;  // [mean][k]: probability of at most k events
};

/// Probability that a standard normal number is below x, for x <= 0, to 1e-13 relative.
double normal_tail(double x);
/// e^x for |x| <= 64, to 1e-14 relative.
double exponential(double x);

}  // namespace rugae
