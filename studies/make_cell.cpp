#include "studies/make_cell.h"

#include <functional>
#include <optional>

#include "cameras/lens_difference.h"
#include "core/check.h"
#include "core/files.h"
#include "dataset/estimate.h"
#include "dataset/observations.h"
#include "recon/pipeline.h"
#include "studies/measure.h"
#include "validate/evaluate.h"

namespace rugae {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

json simulation_json(const SimulateResult& r) {
  return {{"frames", r.frames + r.skipped},
          {"path_length_mm", r.path_length_mm},
          {"min_clearance_mm", r.min_clearance_mm},
          {"seconds", r.wall_s},
          {"frames_per_s", r.wall_s > 0.0 ? json(r.frames / r.wall_s) : json()},
          {"trace_thread_s", r.trace_s},
          {"shade_thread_s", r.shade_s},
          {"label_thread_s", r.label_s},
          {"sensor_thread_s", r.sensor_s},
          {"encode_thread_s", r.encode_s},
          {"write_thread_s", r.write_s}};
}

void make_dataset(const Variant& variant, const Cell& cell, const CellFiles& files,
                  const fs::path& dataset, Progress& progress) {
  if (dataset_finished(dataset)) return;
  SimulateOptions options = variant.simulate;
  options.camera = files.camera;
  options.trajectory = cell.trajectory;
  options.seed = cell.seed;
  if (!files.scene.empty()) {
    make_folder(files.scene.parent_path());
    write_atomic(files.scene, variant.scene_text);
    options.scene = files.scene.string();
  }
  make_folder(dataset.parent_path());
  const json measured = simulation_json(simulate(options, dataset, progress));
  write_atomic(simulation_of(dataset), measured.dump(2) + "\n");
}

// The reason when this stomach has no room for this path, or the like. What goes wrong later, when
// files are written, is not this cell's fault alone.
std::optional<std::string> make_datasets(const Variant& variant, const Cell& cell,
                                         const CellFiles& files, Progress& progress) {
  try {
    make_dataset(variant, cell, files, files.dataset, progress);
    if (files.frames != files.dataset)
      make_dataset(with_clean_frames(variant), cell, files, files.frames, progress);
  } catch (const Interrupted&) {
    throw;
  } catch (const Error& error) {
    if (fs::exists(DatasetLayout{files.dataset}.info())) throw;
    progress.end("gave up");
    return error.what();
  }
  return std::nullopt;
}

// The motion of an earlier run, or of a cell whose map is made otherwise.
Motion make_motion(const FrameSource& frames, const ReconOptions& options, const Stages& stages,
                   const fs::path& file, Progress& progress) {
  if (fs::exists(file)) return read_motion(file);
  Motion motion = estimate_motion(frames, options, stages, progress);
  make_folder(file.parent_path());
  write_motion(file, motion);
  return motion;
}

// What the reconstruction is told of the lens.
struct ToldLens {
  fs::path file;  // empty: the dataset's own, which is the true one
  json metrics = json::object();
};

ToldLens make_lens(const Variant& variant, const Cell& cell, const CellFiles& files,
                   Progress& progress) {
  ToldLens told;
  if (!files.calibration.empty()) {
    const fs::path out = files.calibration.parent_path().parent_path();
    const CalibratedLens made =
        calibrated_lens(calibration_of(variant, cell, files), out, progress);
    told = {made.file, made.metrics};
  }
  if (files.lens.empty()) return told;
  const Lens right = Observations::open(files.dataset, told.file).lens();
  make_folder(files.lens.parent_path());
  write_atomic(files.lens, lens_yaml(perturbed(right, variant.lens_error), "wrong on purpose"));
  told.file = files.lens;
  return told;
}

json measured(const StudyOptions& study, const Variant& variant, const Cell& cell,
              const CellFiles& files, Progress& progress) {
  const PreprocessOptions& preprocess = variant.recon.preprocess;
  if (study.measure == Measure::reflections)
    return measure_reflections(files.dataset, {.reflections = preprocess.reflections}, progress);
  if (study.measure == Measure::vignetting)
    return measure_vignetting(files.dataset, {.preprocess = preprocess}, progress);
  FeatureMeasureOptions options;
  options.step = study.features.step;
  options.stride = study.features.stride;
  options.seed = cell.seed;
  for (const FeatureMethod method : kFeatureMethods)
    if (name_of(method) == cell.method)
      return measure_features(files.dataset, method, options, progress);
  fail("'{}' is no feature method", cell.method);
}

void reconstruct_in_halves(const Variant& variant, const Cell& cell, const CellFiles& files,
                           const fs::path& lens, Progress& progress) {
  ReconOptions options = variant.recon;
  options.method = cell.method;
  options.seed = cell.seed;
  progress.begin("preprocessing");
  const Observations observations = Observations::open(files.frames, lens);
  const FrameSource frames(observations, options.preprocess);
  const Stages stages = stages_with(variant.replace, files.dataset, observations.lens());
  const Motion motion = make_motion(frames, options, stages, files.motion, progress);
  build_map(frames, motion, options, files.estimate, stages, progress);
}

// The reason when the method gave up on these frames.
std::optional<std::string> make_estimate(const std::function<void()>& method,
                                         const fs::path& estimate, Progress& progress) {
  if (fs::exists(EstimateLayout{estimate}.info())) return std::nullopt;
  fs::remove_all(estimate);  // what a killed run left of the map: it has no middle to go on from
  make_folder(estimate);
  try {
    method();
  } catch (const Interrupted&) {
    throw;
  } catch (const Error& error) {
    progress.end("gave up");
    return error.what();
  }
  return std::nullopt;
}

void write_metrics(const CellFiles& files, json metrics) {
  metrics["simulation"] = read_json(simulation_of(files.dataset));
  make_folder(files.metrics.parent_path());
  write_atomic(files.metrics, metrics.dump(1) + "\n");
}

}  // namespace

void make_cell(const StudyOptions& study, const Cell& cell, const CellFiles& files,
               Progress& progress) {
  const Variant& variant = study.variants[static_cast<std::size_t>(cell.variant)];
  if (const auto gave_up = make_datasets(variant, cell, files, progress)) {
    write_failure(files, *gave_up, true);
    return;
  }
  if (study.measure != Measure::loop) {
    write_metrics(files, measured(study, variant, cell, files, progress));
    return;
  }
  const ExternalMethod* const command = study.command_of(cell.method);
  ToldLens lens;
  const auto method = [&] {
    lens = make_lens(variant, cell, files, progress);
    if (command)
      reconstruct_by(*command, files.frames, lens.file, files.estimate, progress);
    else
      reconstruct_in_halves(variant, cell, files, lens.file, progress);
  };
  if (const auto gave_up = make_estimate(method, files.estimate, progress)) {
    // A program may be mended; ours gives up on the same frames each time.
    write_failure(files, *gave_up, command != nullptr);
    return;
  }
  json metrics = evaluate(files.dataset, files.estimate, progress);
  if (lens.metrics.empty()) lens = make_lens(variant, cell, files, progress);  // of an earlier run
  metrics.update(lens.metrics);
  write_metrics(files, metrics);
}

void write_failure(const CellFiles& files, const std::string& reason, bool try_again) {
  json metrics = {{"failed", reason}};
  if (try_again) metrics["try_again"] = true;
  if (fs::exists(simulation_of(files.dataset))) {
    const json simulation = read_json(simulation_of(files.dataset));
    const int frames = simulation.at("frames");
    metrics["simulation"] = simulation;
    metrics["tracking"] = {
        {"frames", frames}, {"tracked", 0}, {"lost", frames}, {"tracked_share", 0.0}};
  }
  make_folder(files.metrics.parent_path());
  write_atomic(files.metrics, metrics.dump(1) + "\n");
}

}  // namespace rugae
