#include "render/noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "core/random.h"
#include "render/electron_noise.h"
#include "render/sensor.h"

namespace rugae {
namespace {

double normal_cdf(double z) { return 0.5 * std::erfc(-z / std::sqrt(2.0)); }

// Chi-square of counts against probabilities must stay below its mean plus five standard
// deviations (dof + 5 sqrt(2 dof)); the draws are fixed, so the test either holds or does not.
void expect_chi_square(const std::vector<double>& counts, const std::vector<double>& probability,
                       double draws) {
  double chi = 0.0, kept_count = 0.0, kept_probability = 0.0;
  int cells = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    kept_count += counts[i];
    kept_probability += probability[i];
    if (kept_probability * draws < 20.0 && i + 1 < counts.size()) continue;  // joins small cells
    const double expected = kept_probability * draws;
    chi += (kept_count - expected) * (kept_count - expected) / expected;
    ++cells;
    kept_count = kept_probability = 0.0;
  }
  ASSERT_GT(cells, 5);
  EXPECT_TRUE(chi < cells + 5.0 * std::sqrt(2.0 * cells)) << chi << " over " << cells << " cells";
}

TEST(Noise, SpecialFunctionsAgreeWithTheLibrary) {
  for (double x = -40.0; x <= 2.0; x += 0.37) EXPECT_NEAR(exponential(x) / std::exp(x), 1.0, 1e-13);
  for (double x = -6.5; x <= 0.0; x += 0.013)
    EXPECT_NEAR(normal_tail(x) / normal_cdf(x), 1.0, 1e-11) << x;
}

TEST(Noise, NormalTableIsTheQuantileFunction) {
  const NormalTable normal;
  for (std::uint64_t i = 0; i < 200000; ++i) {
    // Words of every size: all octaves of the tail.
    const auto words = random_words(1, Purpose::test, 0, i);
    const std::uint32_t tail = (words[0] & 0x7fffffffu) >> (words[1] % 31);
    const double z = normal(tail);
    const double p = (tail + 0.5) * 0x1p-32;
    // One Newton step shows how far z is from the quantile.
    const double off = (normal_cdf(z) - p) / (std::exp(-0.5 * z * z) / std::sqrt(2.0 * kPi));
    ASSERT_TRUE(std::abs(off) < 2e-5) << "tail " << tail << " z " << z;
    ASSERT_EQ(normal(0xffffffffu - (0x7fffffffu - tail)), -normal(tail));
  }
}

TEST(Noise, NormalNumbersAreNormal) {
  const NormalTable normal;
  constexpr int kDraws = 400000, kCells = 200;
  std::vector<double> counts(kCells, 0.0), probability(kCells);
  double sum = 0.0, squares = 0.0;
  for (int i = 0; i < kDraws / 4; ++i)
    for (std::uint32_t word : random_words(3, Purpose::test, 1, i)) {
      const double z = normal(word);
      sum += z;
      squares += z * z;
      counts[std::clamp(static_cast<int>(std::floor((z + 5.0) * 20.0)), 0, kCells - 1)] += 1.0;
    }
  for (int c = 0; c < kCells; ++c)
    probability[c] = (c + 1 == kCells ? 1.0 : normal_cdf(-5.0 + (c + 1) / 20.0)) -
                     (c == 0 ? 0.0 : normal_cdf(-5.0 + c / 20.0));
  expect_chi_square(counts, probability, kDraws);
  EXPECT_NEAR(sum / kDraws, 0.0, 5.0 / std::sqrt(kDraws));
  EXPECT_NEAR(squares / kDraws, 1.0, 5.0 * std::sqrt(2.0 / kDraws));
}

TEST(Noise, PoissonNumbersArePoisson) {
  const PoissonTable poisson;
  for (double mean : {0.0, 0.02, 0.7, 3.4, 11.0, 29.9, 63.5}) {
    constexpr int kDraws = 200000;
    const int most = static_cast<int>(mean + 10.0 * std::sqrt(mean) + 12.0);
    std::vector<double> counts(most + 1, 0.0), probability(most + 1);
    for (int i = 0; i < kDraws; ++i) {
      const auto words = random_words(5, Purpose::test, 2, i);
      counts[std::min(poisson(mean, words[0], words[1]), most)] += 1.0;
    }
    if (mean == 0.0) {
      EXPECT_EQ(counts[0], kDraws);
      continue;
    }
    for (int k = 0; k <= most; ++k)
      probability[k] = std::exp(k * std::log(mean) - mean - std::lgamma(k + 1.0));
    double sum = 0.0;
    for (int k = 0; k <= most; ++k) sum += k * counts[k];
    EXPECT_NEAR(sum / kDraws, mean, 5.0 * std::sqrt(mean / kDraws)) << mean;
    if (mean > 2.0) expect_chi_square(counts, probability, kDraws);
  }
}

// The sensor's electrons against Poisson and normal noise folded together, for every way they are
// drawn: without and with read noise, few and many electrons.
TEST(Noise, ElectronsFollowTheSensorModel) {
  for (double read_e : {0.3, 4.0, 10.0})
    for (double mean : {0.5, 20.0, 60.0, 100.0, 900.0}) {
      const ElectronNoise noise(read_e, 11);
      constexpr int kDraws = 150000;
      const double spread = std::sqrt(mean + read_e * read_e), low = mean - 5.0 * spread,
                   width = std::max(0.05 * spread, 0.02);
      const int cells = static_cast<int>(std::ceil(10.0 * spread / width));
      std::vector<double> counts(cells, 0.0), probability(cells, 0.0);
      double sum = 0.0, squares = 0.0;
      const auto m = static_cast<float>(mean);
      for (int i = 0; i < kDraws / 3; ++i)
        for (float e : noise(std::array<float, 3>{m, m, m}, 4, i)) {
          sum += e - mean;
          squares += (e - mean) * (e - mean);
          counts[std::clamp(static_cast<int>(std::floor((e - low) / width)), 0, cells - 1)] += 1.0;
        }
      const int most = static_cast<int>(mean + 12.0 * std::sqrt(mean) + 20.0);
      for (int k = 0; k <= most; ++k) {
        const double p = std::exp(k * std::log(mean) - mean - std::lgamma(k + 1.0));
        for (int c = 0; c < cells; ++c) {
          const double from = c == 0 ? -1e9 : (low + c * width - k) / read_e,
                       to = c + 1 == cells ? 1e9 : (low + (c + 1) * width - k) / read_e;
          probability[c] += p * (normal_cdf(to) - normal_cdf(from));
        }
      }
      SCOPED_TRACE(testing::Message() << mean << " electrons, read noise " << read_e);
      const double variance = mean + read_e * read_e;
      EXPECT_NEAR(sum / kDraws, 0.0, 5.0 * std::sqrt(variance / kDraws));
      // Var of the sample variance: (kurtosis - 1) sigma^4 / n, kurtosis = 3 + mean / variance^2.
      EXPECT_NEAR(squares / kDraws / variance, 1.0,
                  5.0 * std::sqrt((2.0 + mean / (variance * variance)) / kDraws));
      expect_chi_square(counts, probability, kDraws);
    }
}

TEST(Noise, IsAFunctionOfSeedFrameAndPixel) {
  const ElectronNoise a(10.0, 1), b(10.0, 2);
  const std::array<float, 3> mean{500.0f, 500.0f, 500.0f};
  EXPECT_EQ(a(mean, 3, 77), a(mean, 3, 77));
  EXPECT_NE(a(mean, 3, 77), a(mean, 4, 77));
  EXPECT_NE(a(mean, 3, 77), a(mean, 3, 78));
  EXPECT_NE(a(mean, 3, 77), b(mean, 3, 77));
  const auto e = a(mean, 3, 77);
  EXPECT_NE(e[0], e[1]);
  EXPECT_NE(e[1], e[2]);
}

// Every octave of the table, its ends, and the numbers that have no octave.
TEST(Noise, FourNormalNumbersAreTheSame) {
  const NormalTable normal;
  std::vector<std::uint32_t> words = {0, 1, 15, 16, 17, 31, 32, 33, 0x7fffffff, 0x80000000, ~0u};
  for (int bit = 4; bit < 31; ++bit)
    for (const std::uint32_t beside : {0u, 1u, ~0u})
      for (const std::uint32_t sign : {0u, 1u << 31})
        words.push_back(((1u << bit) + beside) | sign);
  for (std::uint64_t i = 0; i < 1000; ++i)
    words.push_back(random_words(5, Purpose::test, 0, i)[0] >> (i % 32));
  while (words.size() % 4 != 0) words.push_back(0);
  for (std::size_t i = 0; i < words.size(); i += 4) {
    alignas(16) float four[4];
    _mm_store_ps(four, normal(_mm_loadu_si128(reinterpret_cast<const __m128i*>(&words[i]))));
    for (std::size_t k = 0; k < 4; ++k) EXPECT_EQ(four[k], normal(words[i + k])) << words[i + k];
  }
}

// One channel of one pixel is dark, or none; with and without enough read noise for it not to
// matter.
TEST(Noise, FourPixelsAreTheSame) {
  for (const double read_e : {0.3, 4.0, 10.0}) {
    const ElectronNoise noise(read_e, 3);
    for (const float dark_e : {0.0f, 5.0f, 70.0f, 500.0f, -1.0f})
      for (int channel = 0; channel < 3; ++channel) {
        alignas(16) float mean[3][4] = {
            {900.0f, 700.0f, 100.0f, 5000.0f}, {200.0f, 80.0f, 100.0f, 90.0f}, {80, 400, 80, 300}};
        mean[channel][1] = dark_e;
        const Float4x3 means{_mm_load_ps(mean[0]), _mm_load_ps(mean[1]), _mm_load_ps(mean[2])};
        const Float4x3 electrons = noise(means, 9, 1234);
        alignas(16) float four[3][4];
        _mm_store_ps(four[0], electrons.x);
        _mm_store_ps(four[1], electrons.y);
        _mm_store_ps(four[2], electrons.z);
        for (std::size_t k = 0; k < 4; ++k) {
          const auto one =
              noise(std::array<float, 3>{mean[0][k], mean[1][k], mean[2][k]}, 9, 1234 + k);
          for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(four[c][k], one[c]) << dark_e;
        }
      }
  }
}

}  // namespace
}  // namespace rugae
