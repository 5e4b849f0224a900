// What depth maps agree on is kept; smoothness along paths.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "dense_scene.h"
#include "recon/dense/consistency.h"
#include "recon/dense/semi_global.h"

namespace rugae {
namespace {

using namespace testing;

constexpr float kSigma = 0.1f;
constexpr int kSmallestPx = 30;

/// Exact depth maps of one wall from five places a few mm apart.
std::vector<DepthMap> five_maps() {
  const DenseWall wall = plane_wall({0.3, -0.2, 1.0}, 30.0);
  std::vector<DepthMap> maps;
  for (int i = 0; i < 5; ++i) {
    const Rigid3 cam_from_world = looking({2.0 * i - 4.0, 0.5 * i, 0.3 * i}, {0.0, 0.02 * i, 1.0});
    DepthMap map{small_grid(), cam_from_world, true_depth(wall, cam_from_world, small_grid()), {}};
    map.sigma = cv::Mat(map.depth.size(), CV_32F, cv::Scalar(kSigma));
    maps.push_back(map);
  }
  return maps;
}

std::vector<const DepthMap*> others_of(const std::vector<DepthMap>& maps, std::size_t one) {
  std::vector<const DepthMap*> others;
  for (std::size_t i = 0; i < maps.size(); ++i)
    if (i != one) others.push_back(&maps[i]);
  return others;
}

TEST(DenseConsistency, ExactMapsAgreeWhereTheySeeTheSameWall) {
  const auto maps = five_maps();
  const cv::Mat agreeing = agreeing_maps(maps[2], others_of(maps, 2), 3.0);
  EXPECT_EQ(agreeing.at<uchar>(60, 80), 4);
  int all = 0;
  for (int y = 20; y < 100; ++y)
    for (int x = 30; x < 130; ++x) all += agreeing.at<uchar>(y, x) == 4 ? 1 : 0;
  EXPECT_GE(all, 7900);  // of 8000
}

TEST(DenseConsistency, APlantedFalseDepthIsRemoved) {
  auto maps = five_maps();
  const cv::Rect planted(70, 50, 20, 16);
  cv::Mat wrong = maps[2].depth(planted);
  wrong *= 1.05;  // 1.5 mm: fifteen sigma
  // Whoever sees the other maps' truth through the planted wall does not agree with it either.
  const cv::Mat agreeing = agreeing_maps(maps[2], others_of(maps, 2), 3.0);
  const int known = cv::countNonZero(maps[2].depth > 0);
  keep_agreed(maps[2], agreeing, 2, kSmallestPx);
  EXPECT_EQ(cv::countNonZero(maps[2].depth(planted) > 0), 0);
  EXPECT_EQ(cv::countNonZero(maps[2].sigma(planted) > 0), 0);
  EXPECT_GE(cv::countNonZero(maps[2].depth > 0), known - planted.area() - known / 20);
}

TEST(DenseConsistency, AgreementIsMeasuredInSigmas) {
  auto maps = five_maps();
  maps[2].depth += 0.35;  // 2.5 joint sigmas of 0.14
  EXPECT_EQ(agreeing_maps(maps[2], others_of(maps, 2), 2.0).at<uchar>(60, 80), 0);
  EXPECT_EQ(agreeing_maps(maps[2], others_of(maps, 2), 3.0).at<uchar>(60, 80), 4);
}

TEST(DenseConsistency, SmallIslandsGo) {
  auto maps = five_maps();
  cv::Mat agreeing(maps[0].depth.size(), CV_8U, cv::Scalar(0));
  agreeing(cv::Rect(10, 10, 5, 5)).setTo(3);  // 25 px
  agreeing(cv::Rect(60, 60, 8, 8)).setTo(3);  // 64 px
  keep_agreed(maps[0], agreeing, 2, kSmallestPx);
  EXPECT_EQ(cv::countNonZero(maps[0].depth > 0), 64);
}

TEST(DenseConsistency, OverlappingMapsAreThoseOfTheSameWall) {
  auto maps = five_maps();
  const Rigid3 away = looking({0.0, 0.0, 0.0}, {0.0, 0.1, -1.0});
  DepthMap behind{
      small_grid(), away, true_depth(plane_wall(Vec3::UnitZ(), -30.0), away, small_grid()), {}};
  behind.sigma = cv::Mat(behind.depth.size(), CV_32F, cv::Scalar(kSigma));
  maps.push_back(behind);
  const auto overlapping = overlapping_maps(maps, 3);
  EXPECT_EQ(overlapping[0].size(), 3u);
  EXPECT_EQ(overlapping[0][0], 1);  // its neighbour shares the most
  for (std::size_t i = 0; i < 5; ++i)
    for (const int j : overlapping[i]) EXPECT_LT(j, 5);
  EXPECT_TRUE(overlapping[5].empty());
}

// --- Smoothness ------------------------------------------------------------------------------

TEST(DenseSmoothness, AnOutlierFollowsItsNeighboursAndGapsDrawNothing) {
  ScoreVolume scores;
  scores.size = {15, 11};
  scores.count = 9;
  scores.scores.assign(15 * 11 * 9, 0.2f);
  for (int y = 0; y < 11; ++y)
    for (int x = 0; x < 15; ++x) scores.at(x, y)[4] = 0.6f;
  scores.at(7, 5)[4] = 0.55f;
  scores.at(7, 5)[8] = 0.6f;  // a chance match, a little better
  for (int k = 0; k < 9; ++k) scores.at(3, 3)[k] = std::nanf("");
  const ScoreVolume costs = path_costs(scores, {0.02f, 0.2f});
  for (int y = 0; y < 11; ++y)
    for (int x = 0; x < 15; ++x) {
      const float* c = costs.at(x, y);
      EXPECT_EQ(std::min_element(c, c + 9) - c, 4) << x << " " << y;
    }
  // Without neighbours' say each has its own best.
  const ScoreVolume alone = path_costs(scores, {0.0f, 0.0f});
  const float* c = alone.at(7, 5);
  EXPECT_EQ(std::min_element(c, c + 9) - c, 8);
}

}  // namespace
}  // namespace rugae
