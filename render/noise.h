#pragma once
// Random numbers of a sensor from uniform words: normal by table, Poisson exactly at low counts.
// Built from + - * / and sqrt alone, so every machine draws the same.

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "core/float4.h"

namespace rugae {

/// The quantile function of the standard normal distribution over 32-bit words, to 1e-6. The tails
/// shrink by octaves, each octave of the tail probability has 16 cubic pieces (hierarchical
/// segmentation: Lee et al., A hardware Gaussian noise generator, IEEE Trans. Comput. 2006,
/// doi:10.1109/TC.2006.81).
class NormalTable {
 public:
  NormalTable();

  float operator()(std::uint32_t word) const {
    const std::uint32_t tail = word & kTail;  // probability (tail + 0.5) / 2^32, below half
    // The first piece of all holds the numbers below kFirst, a constant each.
    const int shift = std::bit_width(tail | kFirst) - 1 - kSplit;
    const Piece& p = pieces_[(static_cast<std::uint32_t>(shift) << kSplit) + (tail >> shift)];
    const float t = static_cast<float>(static_cast<int>(tail & ((1u << shift) - 1u))) *
                    std::bit_cast<float>((127u - static_cast<unsigned>(shift)) << 23);
    // how far out, in standard deviations, the tail of that probability begins
    const float z = p.c[0] + t * (p.c[1] + t * (p.c[2] + t * p.c[3]));
    return word >> 31 ? z : -z;
  }

  /// The same numbers for four words.
  Float4 operator()(__m128i words) const {
    const __m128i tail = _mm_and_si128(words, _mm_set1_epi32(static_cast<int>(kTail)));
    const __m128i least = _mm_or_si128(tail, _mm_set1_epi32(kFirst));
    // The exponent of a float is the place of the highest bit, if rounding cannot carry into it.
    const __m128i power = _mm_and_si128(
        _mm_castps_si128(_mm_cvtepi32_ps(_mm_andnot_si128(_mm_srli_epi32(least, 1), least))),
        _mm_set1_epi32(0xff << 23));
    const __m128i step = _mm_sub_epi32(power, _mm_set1_epi32(kSplit << 23));  // 2^shift as a float
    const __m128i within =
        _mm_sub_epi32(_mm_cvttps_epi32(_mm_castsi128_ps(step)), _mm_set1_epi32(1));
    const Float4 one_by_step = _mm_castsi128_ps(_mm_sub_epi32(_mm_set1_epi32(254 << 23), step));
    const Float4 t = _mm_cvtepi32_ps(_mm_and_si128(tail, within)) * one_by_step;
    const __m128i in_octave =
        _mm_cvttps_epi32(_mm_cvtepi32_ps(_mm_andnot_si128(within, tail)) * one_by_step);
    const __m128i shift = _mm_sub_epi32(_mm_srli_epi32(step, 23), _mm_set1_epi32(127));
    alignas(16) std::array<std::int32_t, 4> piece;
    _mm_store_si128(reinterpret_cast<__m128i*>(piece.data()),
                    _mm_add_epi32(_mm_slli_epi32(shift, kSplit), in_octave));
    const auto at = [&](int k) {
      return _mm_load_ps(pieces_[static_cast<std::size_t>(piece[k])].c);
    };
    const Float4x4 c = transposed(at(0), at(1), at(2), at(3));
    const Float4 z = c.x + t * (c.y + t * (c.z + t * c.w));
    const __m128i minus = _mm_andnot_si128(words, _mm_set1_epi32(static_cast<int>(~kTail)));
    return _mm_xor_ps(z, _mm_castsi128_ps(minus));
  }

 private:
  static constexpr std::uint32_t kTail = 0x7fffffffu;
  static constexpr int kSplit = 4;  // an octave has 2^4 pieces
  static constexpr int kFirst = 1 << kSplit;
  struct Piece {
    alignas(16) float c[4];
  };

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
