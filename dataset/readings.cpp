#include "dataset/readings.h"

#include <fmt/format.h>

#include <opencv2/core.hpp>

#include "dataset/pose_mistakes.h"

namespace rugae {
namespace {

constexpr const char* kRange = "the depth is the distance along the ray, not along z";
constexpr const char* kTwo = "two mistakes at once: ";

std::string shifted(int by) {
  return fmt::format("the depth is shifted by one frame: that of the {} fits",
                     by < 0 ? "frame before" : "next frame");
}

std::string wrong(const PoseMistake& mistake) { return "the poses are wrong: " + mistake.text; }

}  // namespace

std::vector<Reading> single_readings() {
  std::vector<Reading> readings = {{"as given"}};
  for (const PoseMistake& mistake : pose_mistakes())
    readings.push_back({wrong(mistake), mistake.undo});
  readings.push_back({kRange});
  readings.back().kind = DepthKind::range;
  return readings;
}

std::vector<Reading> paired_readings() {
  std::vector<Reading> readings = {{"as given"}};
  for (const int by : {-1, 1}) {
    readings.push_back({shifted(by)});
    readings.back().depth_of = by;
  }
  for (const PoseMistake& a : pose_mistakes()) {
    readings.push_back({fmt::format("{}{}, and {}", kTwo, wrong(a), kRange), a.undo});
    readings.back().kind = DepthKind::range;
    for (const int by : {-1, 1}) {
      readings.push_back({fmt::format("{}{}, and {}", kTwo, wrong(a), shifted(by)), a.undo});
      readings.back().depth_of = by;
    }
    for (const PoseMistake& b : pose_mistakes())
      if (&a != &b)
        readings.push_back(
            {fmt::format("{}{}, and {}", kTwo, wrong(a), b.text),
             [first = a.undo, second = b.undo](const Rigid3& p) { return second(first(p)); }});
  }
  return readings;
}

std::vector<FlowReading> flow_readings() {
  const auto negated = [](const cv::Mat& f) { return cv::Mat(-f); };
  const auto swapped = [](const cv::Mat& f) {
    cv::Mat other(f.size(), f.type());
    cv::mixChannels(f, other, {0, 1, 1, 0});
    return other;
  };
  std::vector<FlowReading> readings = {
      {"as given"},
      {"the flow's sign is flipped", 0, 0, 0, negated},
      {"the flow's x and y are swapped", 0, 0, 0, swapped},
      {"the flow leads to the frame before, not to the next: its sign and frame are off", 0, 0, 1,
       negated},
      {"the flow is shifted by one frame: that of the frame before fits", 0, 0, -1},
      {"the flow is shifted by one frame: that of the next frame fits", 0, 0, 1},
      {shifted(-1), -1, 0, 0},
      {shifted(1), 1, 0, 0},
      {"the poses are shifted by one frame: those of the frame before fit", 0, -1, 0},
      {"the poses are shifted by one frame: those of the next frame fit", 0, 1, 0}};
  const std::size_t singles = readings.size();
  for (std::size_t a = 1; a < singles; ++a)
    for (std::size_t b = a + 1; b < singles; ++b) {
      const FlowReading first = readings[a], second = readings[b];
      const bool of_flow = first.depth_of == 0 && first.poses_of == 0;
      if (!of_flow || (second.depth_of == 0 && second.poses_of == 0)) continue;
      readings.push_back({fmt::format("{}{}, and {}", kTwo, first.text, second.text),
                          second.depth_of, second.poses_of, first.flow_of, first.flow, true});
    }
  return readings;
}

}  // namespace rugae
