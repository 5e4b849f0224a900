#include "recon/dense/semi_global.h"

#include <algorithm>
#include <array>

namespace rugae {
namespace {

struct Direction {
  int dx, dy;
};
constexpr std::array<Direction, 8> kDirections = {
    {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, -1}, {1, -1}, {-1, 1}}};
/// Of a pixel that no label has a score for.
constexpr float kUnknownCost = 1.0f;

/// 1 - score, without gaps.
ScoreVolume plain_costs(const ScoreVolume& scores) {
  ScoreVolume costs = scores;
  for (std::size_t begin = 0; begin < costs.scores.size();
       begin += static_cast<std::size_t>(costs.count)) {
    float* c = &costs.scores[begin];
    float sum = 0.0f;
    int known = 0;
    for (int k = 0; k < costs.count; ++k)
      if (c[k] == c[k]) sum += c[k] = 1.0f - c[k], ++known;
    const float instead = known > 0 ? sum / static_cast<float>(known) : kUnknownCost;
    for (int k = 0; k < costs.count; ++k)
      if (!(c[k] == c[k])) c[k] = instead;
  }
  return costs;
}

/// L(p, k) = c(p, k) + min(L(q, k), L(q, k +- 1) + one, min L(q) + more) - min L(q), q the pixel
/// before. Lists are padded by a label that costs too much on either side. Returns min L(p).
float step(const float* cost, const float* before, float before_min, int count,
           const SmoothnessCost& s, float* now) {
  float least = 1e9f;
  for (int k = 0; k < count; ++k) {
    const float beside = std::min(before[k], before[k + 2]) + s.one;
    const float value =
        cost[k] + std::min(std::min(before[k + 1], beside), before_min + s.more) - before_min;
    now[k + 1] = value;
    least = std::min(least, value);
  }
  return least;
}

}  // namespace

ScoreVolume path_costs(const ScoreVolume& scores, const SmoothnessCost& smoothness) {
  const ScoreVolume costs = plain_costs(scores);
  ScoreVolume total = costs;
  std::fill(total.scores.begin(), total.scores.end(), 0.0f);
  const int width = costs.size.width, height = costs.size.height, count = costs.count;
  const auto padded = static_cast<std::size_t>(count + 2);
  constexpr float kTooMuch = 1e6f;
  std::vector<float> rows[2], least[2];
  for (int i = 0; i < 2; ++i) {
    rows[i].assign(padded * width, kTooMuch);
    least[i].assign(static_cast<std::size_t>(width), 0.0f);
  }
  for (const Direction& d : kDirections) {
    // So that the pixel before has been there.
    const bool down = d.dy > 0 || (d.dy == 0 && d.dx > 0);
    for (int i = 0; i < height; ++i) {
      const int y = down ? i : height - 1 - i;
      std::vector<float>&now = rows[i % 2], &before = d.dy == 0 ? now : rows[(i + 1) % 2];
      std::vector<float>&now_least = least[i % 2],
      &before_least = d.dy == 0 ? now_least : least[(i + 1) % 2];
      for (int j = 0; j < width; ++j) {
        const int x = down ? j : width - 1 - j;
        float* place = &now[padded * static_cast<std::size_t>(x)];
        const float* cost = costs.at(x, y);
        const int qx = x - d.dx, qy = y - d.dy;
        if (qx < 0 || qx >= width || qy < 0 || qy >= height) {
          std::copy(cost, cost + count, place + 1);
          now_least[x] = *std::min_element(cost, cost + count);
        } else {
          now_least[x] = step(cost, &before[padded * static_cast<std::size_t>(qx)],
                              before_least[qx], count, smoothness, place);
        }
        float* sum = total.at(x, y);
        for (int k = 0; k < count; ++k) sum[k] += place[k + 1];
      }
    }
  }
  for (float& value : total.scores) value /= static_cast<float>(kDirections.size());
  return total;
}

}  // namespace rugae
