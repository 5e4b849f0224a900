#pragma once
// Points of the wall followed over the whole sequence.

#include <cstdint>
#include <vector>

#include "dataset/tracks.h"
#include "render/frame.h"

namespace rugae {

/// `count` points of the wall, each what a pixel drawn by the seed sees in one of up to sixteen
/// frames spread over the sequence: so wall that is seen longer and from nearer has more of them.
/// Fewer only where most pixels see no wall.
std::vector<TrackPoint> choose_track_points(const FrameRenderer& renderer,
                                            const SceneMotion& motion, int frames, int count,
                                            std::uint64_t seed);

/// The points whose places land in the image, in their order.
std::vector<TrackSample> follow_tracks(const FrameRenderer& renderer, const FrameView& view,
                                       const std::vector<TrackPoint>& points);

}  // namespace rugae
