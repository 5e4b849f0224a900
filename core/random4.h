#pragma once
// random_words() for four consecutive indices at once: the same numbers, SSE2.

#include <emmintrin.h>

#include "core/random.h"

namespace rugae {

struct FourRandomWords {
  __m128i word[4];
};

/// Word w of index + k is lane k of word[w]. The lower half of the index must not be within three
/// of its end: no sum is carried into the upper half.
inline FourRandomWords random_words_of_four(std::uint64_t seed, Purpose purpose,
                                            std::uint32_t frame, std::uint64_t index) {
  // Philox4x32-10 (see core/random.h) with its multipliers and key increments. A register holds a
  // word of two indices in the lower halves of its 64-bit lanes, where the product of two of them
  // fits; the upper halves are left to hold whatever comes: nothing reads them.
  const auto both = [](std::uint32_t v) { return _mm_set1_epi32(static_cast<int>(v)); };
  const __m128i m0 = both(0xD2511F53u), m1 = both(0xCD9E8D57u);
  struct Pair {
    __m128i c0, c1, c2, c3;
  };
  const auto low = static_cast<std::uint32_t>(index);
  const auto first = [&](std::uint32_t k) {
    return Pair{_mm_set_epi32(0, static_cast<int>(low + k + 1), 0, static_cast<int>(low + k)),
                both(static_cast<std::uint32_t>(index >> 32)), both(frame),
                both(static_cast<std::uint32_t>(purpose))};
  };
  Pair a = first(0), b = first(2);
  auto k0 = static_cast<std::uint32_t>(seed), k1 = static_cast<std::uint32_t>(seed >> 32);
  constexpr int kRounds = 10;
  for (int round = 0; round < kRounds; ++round) {
    const __m128i key0 = both(k0), key1 = both(k1);
    for (Pair* p : {&a, &b}) {
      const __m128i product0 = _mm_mul_epu32(p->c0, m0), product1 = _mm_mul_epu32(p->c2, m1);
      p->c0 = _mm_xor_si128(_mm_xor_si128(_mm_srli_epi64(product1, 32), p->c1), key0);
      p->c1 = product1;
      p->c2 = _mm_xor_si128(_mm_xor_si128(_mm_srli_epi64(product0, 32), p->c3), key1);
      p->c3 = product0;
    }
    k0 += 0x9E3779B9u;
    k1 += 0xBB67AE85u;
  }
  const auto lower_halves = [](__m128i of_a, __m128i of_b) {
    return _mm_castps_si128(
        _mm_shuffle_ps(_mm_castsi128_ps(of_a), _mm_castsi128_ps(of_b), _MM_SHUFFLE(2, 0, 2, 0)));
  };
  return {{lower_halves(a.c0, b.c0), lower_halves(a.c1, b.c1), lower_halves(a.c2, b.c2),
           lower_halves(a.c3, b.c3)}};
}

}  // namespace rugae
