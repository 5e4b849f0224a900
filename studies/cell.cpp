#include "studies/cell.h"

#include <functional>

#include "core/check.h"
#include "core/files.h"
#include "core/like.h"
#include "core/presets.h"
#include "dataset/estimate.h"
#include "dataset/layout.h"
#include "dataset/observations.h"
#include "recon/pipeline.h"
#include "validate/evaluate.h"

namespace rugae {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

// Raised when the same settings give other results, so that older ones are not taken for new.
constexpr int kResultsVersion = 2;
constexpr std::size_t kHashLetters = 10;

std::string stem(const std::string& name_or_path) { return fs::path(name_or_path).stem().string(); }

// A preset may build on another of its kind, so all of them count, and a file on other files.
std::string preset_hash(const std::string& kind, const std::string& what,
                        const std::string& name_or_path) {
  const fs::path file = find_preset(kind, what, name_or_path);
  std::string hashes;
  if (file.extension() == ".yaml" || file.extension() == ".yml")
    for (const LikeFile& of : read_like_chain(kind, what, file)) hashes += sha256_of_file(of.file);
  else
    hashes = sha256_of_file(file);
  for (const std::string& name : preset_names(kind))
    hashes += sha256_of_file(find_preset(kind, what, name));
  return sha256_of_bytes(hashes);
}

// Everything the dataset is a function of.
json dataset_key(const SimulateOptions& s, const Cell& cell) {
  return {{"version", kResultsVersion},
          {"scene", preset_hash("scenes", "scene", s.scene)},
          {"camera", preset_hash("cameras", "camera", cell.camera)},
          {"trajectory", preset_hash("trajectories", "trajectory", cell.trajectory)},
          {"resolution", s.resolution},
          {"frames", s.frames},
          {"seed", cell.seed},
          {"render", json::parse(settings_json(s.render))}};
}

std::string short_hash(const json& key) {
  return sha256_of_bytes(key.dump()).substr(0, kHashLetters);
}

json simulation_json(const SimulateResult& r) {
  return {{"frames", r.frames},
          {"path_length_mm", r.path_length_mm},
          {"min_clearance_mm", r.min_clearance_mm},
          {"seconds", r.wall_s},
          {"frames_per_s", r.wall_s > 0.0 ? json((r.frames - r.skipped) / r.wall_s) : json()},
          {"trace_thread_s", r.trace_s},
          {"shade_thread_s", r.shade_s},
          {"label_thread_s", r.label_s},
          {"sensor_thread_s", r.sensor_s},
          {"encode_thread_s", r.encode_s},
          {"write_thread_s", r.write_s}};
}

json read_json(const fs::path& file) {
  try {
    return json::parse(read_text(file));
  } catch (const json::exception& error) {
    fail("{}: not JSON: {}", file.string(), error.what());
  }
}

// The dataset, from an earlier run where it is complete; returns what simulating measured.
json make_dataset(SimulateOptions options, const Cell& cell, const fs::path& dataset,
                  Progress& progress) {
  fs::path times = dataset;
  times += ".json";
  if (fs::exists(DatasetLayout{dataset}.manifest()) && fs::exists(times)) return read_json(times);
  options.camera = cell.camera;
  options.trajectory = cell.trajectory;
  options.seed = cell.seed;
  const json measured = simulation_json(simulate(options, dataset, progress));
  write_atomic(times, measured.dump(2) + "\n");
  return measured;
}

// The reason when the method gave up on these frames: a result of the study like any other.
std::optional<std::string> make_estimate(const std::function<void()>& method,
                                         const fs::path& estimate, Progress& progress) {
  if (fs::exists(EstimateLayout{estimate}.info())) return std::nullopt;
  fs::remove_all(estimate);  // what a killed run left: reconstruction has no middle to go on from
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

// What a program's estimate is a function of: its arguments, and its text where it is a file.
json command_key(const ExternalMethod& method) {
  const std::string& program = method.command[0];
  return {{"command", method.command},
          {"program", fs::is_regular_file(program) ? sha256_of_file(program) : std::string()}};
}

json metrics_of_failure(const std::string& reason, const json& simulation) {
  const int frames = simulation.at("frames");
  return {
      {"failed", reason},
      {"tracking", {{"frames", frames}, {"tracked", 0}, {"lost", frames}, {"tracked_share", 0.0}}}};
}

}  // namespace

std::string Cell::name() const {
  std::string name = fmt::format("{}_{}_{}", stem(camera), stem(trajectory), method);
  if (!settings.empty()) name += fmt::format("_v{}", variant + 1);
  if (one_of_seeds) name += fmt::format("_seed{}", seed);
  return name;
}

std::string Cell::setting() const {
  std::string text = shown(settings);
  if (one_of_seeds) text += fmt::format("{}seed {}", text.empty() ? "" : ", ", seed);
  return text;
}

std::string Cell::title() const {
  const std::string more = setting();
  return fmt::format("{}, trajectory {}, {}{}", stem(camera), stem(trajectory), method,
                     more.empty() ? "" : ", " + more);
}

std::vector<Cell> cells_of(const StudyOptions& study) {
  std::vector<Cell> cells;
  for (const std::string& camera : study.cameras)
    for (const std::string& trajectory : study.trajectories)
      for (int v = 0; v < static_cast<int>(study.variants.size()); ++v)
        for (const std::uint64_t seed : study.seeds)
          for (const std::string& method : study.methods)
            cells.push_back({camera, trajectory, method, study.variants[v].settings, seed,
                             study.seeds.size() > 1, v});
  return cells;
}

CellResult run_cell(const StudyOptions& study, const Cell& cell, const fs::path& out,
                    Progress& progress) {
  for (const char* folder : {"datasets", "estimates", "metrics"}) make_folder(out / folder);
  const Variant& variant = study.variants[static_cast<std::size_t>(cell.variant)];
  ReconOptions recon = variant.recon;
  recon.method = cell.method;
  recon.seed = cell.seed;
  const json data_key = dataset_key(variant.simulate, cell);
  const std::string data_hash = short_hash(data_key);
  const ExternalMethod* const command = study.command_of(cell.method);
  const std::string hash =
      short_hash(command ? json{{"dataset", data_key}, {"command", command_key(*command)}}
                         : json{{"dataset", data_key}, {"recon", to_json_text(recon)}});

  CellResult result;
  result.cell = cell;
  result.dataset = out / "datasets" /
                   fmt::format("{}_{}_{}", stem(cell.camera), stem(cell.trajectory), data_hash);
  result.estimate = out / "estimates" / fmt::format("{}_{}", cell.name(), hash);
  const fs::path metrics = out / "metrics" / fmt::format("{}_{}.json", cell.name(), hash);
  result.kept = fs::exists(metrics) && fs::exists(DatasetLayout{result.dataset}.manifest());
  if (result.kept) {
    result.metrics = read_json(metrics);
    return result;
  }
  const json simulation = make_dataset(variant.simulate, cell, result.dataset, progress);
  const auto method = [&] {
    if (command)
      reconstruct_by(*command, result.dataset, result.estimate, progress);
    else
      reconstruct(Observations::open(result.dataset), recon, result.estimate, progress);
  };
  const auto gave_up = make_estimate(method, result.estimate, progress);
  result.metrics = gave_up ? metrics_of_failure(*gave_up, simulation)
                           : evaluate(result.dataset, result.estimate, progress);
  result.metrics["simulation"] = simulation;
  if (gave_up && command) return result;  // a program may be mended: it is tried again next time
  write_atomic(metrics, result.metrics.dump(1) + "\n");
  return result;
}

}  // namespace rugae
