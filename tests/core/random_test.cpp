#include "core/random.h"

#include <gtest/gtest.h>

#include <set>

#include "core/random4.h"

namespace rugae {
namespace {

// Philox4x32-10, counter and key of pi's digits: Random123's published known-answer vector
// (kat_vectors).
TEST(Random, KnownAnswerOfPhilox) {
  using Generator = r123::Philox4x32;
  const Generator::ctr_type counter{{0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}};
  const Generator::key_type key{{0xa4093822, 0x299f31d0}};
  const auto words = Generator()(counter, key);
  EXPECT_EQ(words[0], 0xd16cfe09u);
  EXPECT_EQ(words[1], 0x94fdccebu);
  EXPECT_EQ(words[2], 0x5001e420u);
  EXPECT_EQ(words[3], 0x24126ea1u);
}

TEST(Random, FourAtOnceAreTheSameWords) {
  for (const std::uint64_t index : {0ull, 5ull, (3ull << 48) + (1ull << 40) + 307196ull}) {
    const auto four = random_words_of_four(0x0123456789abcdefull, Purpose::test, 77, index);
    for (std::uint64_t k = 0; k < 4; ++k) {
      const auto one = random_words(0x0123456789abcdefull, Purpose::test, 77, index + k);
      for (int w = 0; w < 4; ++w) {
        alignas(16) std::uint32_t lanes[4];
        _mm_store_si128(reinterpret_cast<__m128i*>(lanes), four.word[w]);
        EXPECT_EQ(lanes[k], one[w]) << index << ", word " << w << " of the " << k << "th after it";
      }
    }
  }
}

TEST(Random, EveryPartOfTheKeyMatters) {
  std::set<std::uint32_t> seen;
  seen.insert(random_words(1, Purpose::test, 0, 0)[0]);
  seen.insert(random_words(2, Purpose::test, 0, 0)[0]);
  seen.insert(random_words(1ull << 32 | 1, Purpose::test, 0, 0)[0]);
  seen.insert(random_words(1, Purpose::read_noise, 0, 0)[0]);
  seen.insert(random_words(1, Purpose::test, 1, 0)[0]);
  seen.insert(random_words(1, Purpose::test, 0, 1)[0]);
  seen.insert(random_words(1, Purpose::test, 0, 1ull << 32)[0]);
  EXPECT_EQ(seen.size(), 7u);
}

TEST(Random, NormalMomentsWithinFourStandardErrors) {
  constexpr int kCalls = 50000, kCount = 4 * kCalls;
  double sum = 0.0, squares = 0.0, fourth = 0.0;
  for (int i = 0; i < kCalls; ++i)
    for (double n : random_normal(9, Purpose::test, 0, i)) {
      sum += n;
      squares += n * n;
      fourth += n * n * n * n;
    }
  const double error = 4.0 / std::sqrt(kCount);
  EXPECT_NEAR(sum / kCount, 0.0, error);
  EXPECT_NEAR(squares / kCount, 1.0, error * std::sqrt(2.0));
  EXPECT_NEAR(fourth / kCount, 3.0, error * std::sqrt(96.0));
}

TEST(Random, UniformIsOpen) {
  EXPECT_TRUE(uniform01(0) > 0.0);
  EXPECT_TRUE(uniform01(0xffffffffu) < 1.0);
}

}  // namespace
}  // namespace rugae
