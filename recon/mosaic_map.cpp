#include "recon/mosaic_map.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <numeric>
#include <utility>

#include "core/seconds_of.h"
#include "core/spread.h"

namespace rugae {
namespace {

constexpr std::size_t kAtOnce = 4;  // mosaics that are held whole

// Mosaics of one part of the path share key frames: one after another, these are read once.
std::vector<std::size_t> in_order_of_time(const std::vector<MosaicPlan>& plans) {
  std::vector<std::size_t> order(plans.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t i) { return plans[i].anchor; });
  return order;
}

}  // namespace

MosaicMap build_mosaic_map(const FrameSource& frames, const Structure& structure,
                           const std::vector<PairAlignment>& pairs, const ReconOptions& options,
                           const Stages& stages, int examples, Progress& progress) {
  progress.begin("mosaic plans");
  const Lens& lens = frames.lens();
  const std::vector<MosaicPlan> plans = plan_mosaics(structure, pairs, lens, options.mosaic);
  progress.begin("mosaics", plans.size());
  const std::vector<std::size_t> order = in_order_of_time(plans);
  const std::vector<int> shown = spread(static_cast<int>(plans.size()), examples);
  std::vector<MosaicExample> kept(plans.size());
  std::vector<std::optional<DepthView>> placed(plans.size());
  double shading_s = 0.0;
  for (std::size_t begin = 0; begin < order.size(); begin += kAtOnce) {
    const std::size_t end = std::min(order.size(), begin + kAtOnce);
    std::vector<Mosaic> mosaics(end - begin);
    // Side by side: most of what a picture takes runs on one thread.
    tbb::parallel_for(begin, end, [&](std::size_t i) {
      mosaics[i - begin] = compose_mosaic(frames, structure, plans[order[i]], options.mosaic);
    });
    shading_s += seconds_of([&] {
      tbb::parallel_for(begin, end, [&](std::size_t i) {
        const std::size_t number = order[i];
        Mosaic& mosaic = mosaics[i - begin];
        auto depth = stages.depth(mosaic, structure, lens, options);
        if (depth) placed[number] = depth_view(mosaic, *depth, structure, lens);
        if (std::ranges::binary_search(shown, static_cast<int>(number)))
          kept[number] = {static_cast<int>(number), std::move(mosaic), std::move(depth)};
      });
    });
    progress.step(end - begin);
  }
  std::vector<DepthView> views;
  for (auto& view : placed)
    if (view) views.push_back(std::move(*view));
  progress.end(fmt::format("{} of {} placed", views.size(), plans.size()));
  progress.split_off("shape from shading", shading_s);

  progress.begin("map");
  MosaicMap map;
  map.mesh = fuse_views(std::move(views), options.map);
  for (const int number : shown) map.examples.push_back(std::move(kept[number]));
  return map;
}

}  // namespace rugae
