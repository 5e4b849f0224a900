#pragma once
// The random numbers of a trajectory: one channel (the "frame" of Purpose::trajectory) a use.

#include <cstdint>

namespace rugae {

enum TrajectoryChannel : std::uint32_t {
  kChannelStart = 1,
  kChannelLoopSize = 2,
  kChannelLoopPhase = 3,
  kChannelSwayAround = 4,
  kChannelSwayAlong = 5,
  kChannelBursts = 6,
  kChannelBoardStart = 7,
  kChannelBoardView = 8,
};

}  // namespace rugae
