#include "recon/pipeline.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "core/check.h"
#include "core/files.h"
#include "core/in_lots.h"
#include "core/spread.h"
#include "dataset/image_io.h"
#include "recon/dense/dense_map.h"
#include "recon/dense/moving_keyframes.h"
#include "recon/map.h"
#include "recon/mosaic_map.h"
#include "recon/pictures.h"
#include "recon/reconstruction.h"

namespace rugae {
namespace {

constexpr int kPictures = 6;         // of each stage
constexpr std::size_t kAtOnce = 16;  // depth maps between two steps of the progress line

// `motions` of the key frames, or none.
void write_depth(const EstimateLayout& layout, const TriangleMesh& map, const Structure& structure,
                 const std::vector<CameraMotion>& motions, const RollingShutter& shutter,
                 Progress& progress) {
  make_folder(layout.depth_folder());
  std::vector<int> placed;
  for (std::size_t k = 0; k < structure.frames.size(); ++k)
    if (structure.placed[k]) placed.push_back(static_cast<int>(k));
  progress.begin("depth of key frames", placed.size());
  const std::vector<Vec3> rays = pixel_rays(shutter.original());
  do_in_lots(placed.size(), kAtOnce, progress, [&](std::size_t i) {
    const int k = placed[i];
    const CameraMotion motion = motions.empty() ? CameraMotion() : motions[k];
    write_exr(layout.depth(structure.frames[k]),
              keyframe_depth(map, {structure.cam_from_world[k], motion}, shutter, rays));
  });
  progress.end();
}

// What a reader of estimate.json wants to know of the run.
Estimate estimate_of(const Observations& observations, const ReconOptions& options,
                     const Motion& motion) {
  const Structure& structure = motion.structure;
  const std::vector<std::optional<Rigid3>>& poses = motion.cam_from_world;
  Estimate e;
  e.method = options.method;
  e.options_json = to_json_text(options);
  e.lens = observations.lens();
  e.scale_sigma_share = structure.scale_sigma_share;
  for (const StageTime& stage : motion.stages) e.path_s += stage.seconds;
  e.states.assign(poses.size(), FrameState::lost);
  e.world_from_camera.assign(poses.size(), Rigid3{});
  for (std::size_t i = 0; i < poses.size(); ++i) {
    e.times_s.push_back(observations.time_s(static_cast<int>(i)));
    if (!poses[i]) continue;
    e.states[i] = FrameState::resected;
    e.world_from_camera[i] = poses[i]->inverse();
  }
  for (std::size_t k = 0; k < structure.frames.size(); ++k)
    if (structure.placed[k]) e.states[structure.frames[k]] = FrameState::keyframe;
  std::size_t observed = 0;
  for (const Track& track : structure.tracks) {
    e.points.push_back(track.point);
    observed += track.observations.size();
  }
  const double points = static_cast<double>(structure.tracks.size());
  e.numbers = {{"keyframes", static_cast<double>(structure.frames.size())},
               {"keyframes_placed", static_cast<double>(structure.placed_count())},
               {"points", points},
               {"mean_track_length", points > 0 ? static_cast<double>(observed) / points : 0.0},
               {"mean_reprojection_px", structure.mean_reprojection_px},
               {"bundle_iterations", static_cast<double>(structure.iterations)},
               {"bundle_converged", structure.converged ? 1.0 : 0.0}};
  return e;
}

}  // namespace

MadeMap make_map(const FrameSource& frames, const Structure& structure,
                 const std::vector<CameraMotion>& motions, const std::vector<PairAlignment>& pairs,
                 const ReconOptions& options, const Stages& stages, Progress& progress) {
  MadeMap made;
  const int examples = options.pictures ? kPictures : 0;
  if (options.method == "dense") {
    DenseMap map = build_dense_map(frames, structure, motions, options.preprocess.reflections,
                                   options.dense, examples, progress);
    made.mesh = std::move(map.mesh);
    made.examples = std::move(map.examples);
    made.numbers = {{"depth_maps", map.depth_maps},
                    {"depth_share", map.depth_share},
                    {"median_sigma_over_depth", map.median_sigma}};
    return made;
  }
  MosaicMap map =
      build_mosaic_map(frames, structure, pairs, options, stages, 2 * examples, progress);
  made.mesh = std::move(map.mesh);
  made.mosaics = std::move(map.examples);
  return made;
}

Estimate build_map(const FrameSource& frames, const Motion& motion, const ReconOptions& options,
                   const std::filesystem::path& out, const Stages& stages, Progress& progress,
                   Listener* listener) {
  const EstimateLayout layout{out};
  make_estimate_folder(out);
  progress.end();
  frames.release();
  const auto earlier = static_cast<std::ptrdiff_t>(progress.stages().size());  // of the caller
  const Structure& structure = motion.structure;

  Estimate estimate = estimate_of(frames.observations(), options, motion);
  // The paper's method takes every shutter for a global one.
  const bool rolling = options.method == "dense" && frames.shutter().rolling();
  const std::vector<CameraMotion> motions =
      rolling ? keyframe_motions(frames, structure) : std::vector<CameraMotion>();
  MadeMap made = make_map(frames, structure, motions, motion.pairs, options, stages, progress);
  estimate.map = std::move(made.mesh);
  estimate.numbers.insert(made.numbers.begin(), made.numbers.end());
  discard_estimate(out);
  write_depth(layout, estimate.map, structure, motions, frames.shutter(), progress);
  if (options.pictures) {
    progress.begin("pictures");
    const PictureSink sink = [&](const std::string& name, const cv::Mat& image) {
      const std::filesystem::path file = layout.pictures() / name;
      make_folder(file.parent_path());
      write_image(file, image);
      if (listener != nullptr) listener->picture(name, image);
    };
    draw_preprocess(sink, frames, spread(frames.size(), kPictures), options.preprocess);
    draw_pairs(sink, frames, motion.pairs);
    draw_tracks(sink, frames, structure,
                spread(static_cast<int>(structure.frames.size()), kPictures));
    draw_links(sink, structure);
    if (options.method == "dense")
      draw_depth_maps(sink, made.examples, options.dense.max_sigma_share);
    else
      draw_mosaics(sink, made.mosaics);
  }
  progress.end();
  estimate.stages = motion.stages;
  estimate.stages.insert(estimate.stages.end(), progress.stages().begin() + earlier,
                         progress.stages().end());
  write_estimate(out, estimate);
  return estimate;
}

Estimate reconstruct(const Observations& observations, const ReconOptions& options,
                     const std::filesystem::path& out, Progress& progress) {
  make_estimate_folder(out);
  Reconstruction reconstruction(observations, options);
  progress.begin("frames", static_cast<std::size_t>(observations.size()));
  while (reconstruction.size() < observations.size()) {
    reconstruction.add();
    progress.step();
  }
  return reconstruction.finish(out, progress);
}

}  // namespace rugae
