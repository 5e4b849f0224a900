#include "render/noise.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/units.h"

namespace rugae {

// e^x = (e^(x / 2^k))^(2^k), the small power by its Taylor series.
double exponential(double x) {
  constexpr int kHalvings = 8, kTerms = 14;
  const double small = x / (1 << kHalvings);
  double sum = 1.0;
  for (int i = kTerms; i >= 1; --i) sum = 1.0 + sum * small / i;
  for (int i = 0; i < kHalvings; ++i) sum *= sum;
  return sum;
}

// Near zero 1/2 + phi(x) (x + x^3/3 + x^5/15 + ...), further out Laplace's continued fraction
// phi(x) / (|x| + 1/(|x| + 2/(|x| + 3/...))); Abramowitz and Stegun 26.2.11 and 26.2.14.
double normal_tail(double x) {
  const double density = exponential(-0.5 * x * x) / std::sqrt(2.0 * kPi);
  if (x > -2.5) {
    double sum = 0.0, term = x;
    for (int i = 1; i < 120; ++i) {
      sum += term;
      term *= x * x / (2 * i + 1);
    }
    return 0.5 + density * sum;
  }
  double fraction = -x;
  for (int i = 200; i >= 1; --i) fraction = -x + i / fraction;
  return density / fraction;
}

namespace {

// |z| with normal_tail(-|z|) = p, by bisection and Newton's method.
double normal_quantile(double p) {
  double low = 0.0, high = 7.0;
  for (int i = 0; i < 10; ++i) {
    const double middle = 0.5 * (low + high);
    (normal_tail(-middle) > p ? low : high) = middle;
  }
  double z = 0.5 * (low + high);
  for (int i = 0; i < 4; ++i) {
    const double density = exponential(-0.5 * z * z) / std::sqrt(2.0 * kPi);
    z += (normal_tail(-z) - p) / density;
  }
  return z;
}

}  // namespace

NormalTable::NormalTable() {
  constexpr int kOctaves = 31 - kSplit;  // of tails from 2^kSplit to 2^31
  pieces_.resize(static_cast<std::size_t>(kOctaves + 1) << kSplit);
  for (std::uint32_t tail = 0; tail < kFirst; ++tail)
    pieces_[tail] = {{static_cast<float>(normal_quantile((tail + 0.5) * 0x1p-32)), 0, 0, 0}};
  for (int shift = 0; shift < kOctaves; ++shift)
    for (int i = 0; i < kFirst; ++i) {
      const double start = static_cast<double>(static_cast<std::uint64_t>(kFirst + i) << shift);
      const double width = static_cast<double>(1ull << shift);
      // The cubic through the quantile at t = 0, 1/3, 2/3, 1 (Newton's divided differences).
      std::array<double, 4> z;
      for (int k = 0; k < 4; ++k)
        z[k] = normal_quantile(std::min((start + 0.5 + width * k / 3.0) * 0x1p-32, 0.5));
      const double d1 = z[1] - z[0], d2 = z[2] - 2 * z[1] + z[0],
                   d3 = z[3] - 3 * z[2] + 3 * z[1] - z[0];
      // With s = 3 t: z0 + d1 s + d2 s (s - 1) / 2 + d3 s (s - 1) (s - 2) / 6
      pieces_[((shift + 1) << kSplit) + i] = {
          {static_cast<float>(z[0]), static_cast<float>(3.0 * (d1 - d2 / 2.0 + d3 / 3.0)),
           static_cast<float>(9.0 * (d2 / 2.0 - d3 / 2.0)), static_cast<float>(27.0 * d3 / 6.0)}};
    }
}

PoissonTable::PoissonTable() : below_(kExactBelow) {
  // p_k = mean^k e^-mean / k!
  for (int mean = 0; mean < kExactBelow; ++mean) {
    double p = exponential(-mean), sum = p;
    below_[mean].push_back(sum);
    for (int k = 1; k <= mean || p > 0x1p-40; ++k) {
      p *= static_cast<double>(mean) / k;
      sum += p;
      below_[mean].push_back(sum);
    }
  }
}

int PoissonTable::operator()(double mean, std::uint32_t whole_word,
                             std::uint32_t fraction_word) const {
  const int whole = std::clamp(static_cast<int>(mean), 0, kExactBelow - 1);
  const std::vector<double>& row = below_[whole];
  const double u = (whole_word + 0.5) * 0x1p-32;
  const auto at = std::ranges::upper_bound(row, u);
  int count = static_cast<int>(std::min(at, row.end() - 1) - row.begin());

  const double fraction = mean - whole;
  double p = exponential(-fraction), sum = p;
  const double v = (fraction_word + 0.5) * 0x1p-32;
  constexpr int kMost = 20;  // beyond it the probability is below 2^-60
  for (int k = 1; sum <= v && k <= kMost; ++k) {
    p *= fraction / k;
    sum += p;
    ++count;
  }
  return count;
}

}  // namespace rugae
