#pragma once
// Ways to read a sequence that somebody else made: what its depth, poses and flow may stand for.

#include <functional>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "core/rigid3.h"
#include "dataset/warp.h"

namespace rugae {

/// Which pose and which depth stand for a frame.
struct Reading {
  std::string text;
  std::function<Rigid3(const Rigid3&)> pose = [](const Rigid3& p) { return p; };
  DepthKind kind = DepthKind::z;
  int depth_of = 0;  // frames later
};

/// "as given" first, then each usual mistake of the poses undone, then depth along the ray.
std::vector<Reading> single_readings();

/// "as given", then depth of the frame before and of the next frame, then two mistakes at once: of
/// the poses and of the depth, or two of the poses in either order.
std::vector<Reading> paired_readings();
constexpr std::size_t kFirstPair = 3;

/// Which depth, poses and flow stand for a frame when its flow is compared.
struct FlowReading {
  std::string text;
  int depth_of = 0, poses_of = 0, flow_of = 0;  // frames later
  std::function<cv::Mat(const cv::Mat&)> flow = [](const cv::Mat& f) { return f; };
  bool pair = false;  // two mistakes at once
};

/// "as given" first, then single mistakes, then two at once.
std::vector<FlowReading> flow_readings();

}  // namespace rugae
