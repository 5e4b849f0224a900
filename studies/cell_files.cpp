#include "studies/cell_files.h"

#include "core/check.h"
#include "core/files.h"
#include "core/like.h"
#include "core/presets.h"
#include "dataset/layout.h"
#include "recon/motion.h"

namespace rugae {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

// Raised when the same settings give other frames or labels, or other estimates and metrics of the
// same frames, so that older ones are not taken for new.
constexpr int kRenderingVersion = 3, kResultsVersion = 17;
constexpr std::size_t kHashLetters = 10;

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
json dataset_key(const Variant& variant, const Cell& cell, const std::string& camera) {
  const SimulateOptions& s = variant.simulate;
  const std::string scene =
      sha256_of_bytes(preset_hash("scenes", "scene", s.scene) + variant.scene_text);
  json key = {{"version", kRenderingVersion},
              {"scene", scene},
              {"camera", preset_hash("cameras", "camera", camera)},
              {"trajectory", preset_hash("trajectories", "trajectory", cell.trajectory)},
              {"resolution", s.resolution},
              {"frames", s.frames},
              {"first", s.first},
              {"seed", cell.seed},
              {"render", json::parse(settings_json(s.render))}};
  // Datasets of these are told apart from those made before calibration.yaml said as much.
  const Camera loaded = load_camera(camera);
  if (s.render.lens.rolling_shutter && loaded.sensor.shutter == Shutter::rolling)
    key["row_time"] = true;
  if (!all_central(loaded.lights)) key["lights"] = true;
  return key;
}

std::string short_hash(const json& key) {
  return sha256_of_bytes(key.dump()).substr(0, kHashLetters);
}

std::string camera_of(const Variant& variant, const Cell& cell, const fs::path& out) {
  if (variant.camera_changes.empty()) return cell.camera;
  const std::string text = camera_text(cell.camera, variant.camera_changes);
  const fs::path file =
      out / "cameras" / fmt::format("{}_{}.yaml", stem(cell.camera), short_hash(text));
  if (!fs::exists(file)) {
    make_folder(file.parent_path());
    write_atomic(file, text);
  }
  return file.string();
}

// What a program's estimate is a function of: its arguments, and their text where they are files,
// such as a script behind its interpreter.
json command_key(const ExternalMethod& method) {
  json files = json::array();
  for (const std::string& argument : method.command)
    files.push_back(fs::is_regular_file(argument) ? sha256_of_file(argument) : std::string());
  return {{"command", method.command}, {"files", files}};
}

// The finished metrics are whole, since they are written so; what is asked for is one word of them.
bool tried_again(const fs::path& metrics) { return read_json(metrics).value("try_again", false); }

}  // namespace

fs::path simulation_of(const fs::path& dataset) {
  fs::path file = dataset;
  file += ".json";
  return file;
}

bool dataset_finished(const fs::path& dataset) {
  return fs::exists(DatasetLayout{dataset}.manifest()) && fs::exists(simulation_of(dataset));
}

bool CellFiles::finished() const {
  return fs::exists(metrics) && (!frames_kept || dataset_finished(dataset)) &&
         !tried_again(metrics);
}

CalibrationRun calibration_of(const Variant& variant, const Cell& cell, const CellFiles& files) {
  CalibrationRun run;
  run.camera = files.camera;
  run.seed = cell.seed;
  run.render = variant.simulate.render;
  return run;
}

CellFiles files_of(const StudyOptions& study, const Cell& cell, const fs::path& out) {
  const Variant& variant = study.variants[static_cast<std::size_t>(cell.variant)];
  CellFiles files;
  files.frames_kept = study.keep == Keep::all;
  files.camera = camera_of(variant, cell, out);
  const json data_key = dataset_key(variant, cell, files.camera);
  const std::string where = fmt::format("{}_{}", stem(cell.camera), stem(cell.trajectory));
  const auto dataset = [&](const json& key) {
    return out / "datasets" / fmt::format("{}_{}", where, short_hash(key));
  };
  files.dataset = files.frames = dataset(data_key);
  if (!variant.scene_text.empty())
    files.scene = out / "scenes" / (short_hash(variant.scene_text) + ".yaml");
  json key = {{"version", kResultsVersion}, {"dataset", data_key}};
  if (variant.replace == Replace::frames) {
    const json clean_key = dataset_key(with_clean_frames(variant), cell, files.camera);
    files.frames = dataset(clean_key);
    key["frames"] = clean_key;
  }
  if (variant.calibrate) {
    files.calibration = calibration_folder(calibration_of(variant, cell, files), out);
    key["calibration"] = files.calibration.filename().string();
  }
  if (variant.lens_error != 0.0) {
    key["lens_error"] = variant.lens_error;
    const json lens_key = {{"camera", preset_hash("cameras", "camera", files.camera)},
                           {"calibration", files.calibration.filename().string()},
                           {"error", variant.lens_error}};
    files.lens =
        out / "lenses" / fmt::format("{}_{}.yaml", stem(cell.camera), short_hash(lens_key));
  }
  if (study.measure != Measure::loop) {
    key["measure"] = measure_names()[static_cast<std::size_t>(study.measure)];
    key["features"] = {study.features.step, study.features.stride};
  }
  if (const ExternalMethod* const command = study.command_of(cell.method)) {
    key["command"] = command_key(*command);
  } else {
    ReconOptions recon = variant.recon;
    recon.method = cell.method;
    recon.seed = cell.seed;
    const auto replaced = [](Replace r) { return replace_names()[static_cast<std::size_t>(r)]; };
    const bool deep = variant.replace == Replace::depth;  // the motion is ours
    key["replace"] = replaced(deep ? Replace::nothing : variant.replace);
    key["recon"] = to_json_text(motion_options(recon));
    files.motion = out / "motions" / fmt::format("{}_{}.cbor", where, short_hash(key));
    key["replace"] = replaced(variant.replace);
    key["recon"] = to_json_text(recon);
  }
  const std::string name = fmt::format("{}_{}_{}", where, cell.method, short_hash(key));
  files.estimate = out / "estimates" / name;
  files.metrics = out / "metrics" / (name + ".json");
  return files;
}

json read_json(const fs::path& file) {
  try {
    return json::parse(read_text(file));
  } catch (const json::exception& error) {
    fail("{}: not JSON: {}", file.string(), error.what());
  }
}

CellResult read_cell(const Cell& cell, const CellFiles& files) {
  CellResult result{cell, files.dataset, files.estimate, read_json(files.metrics)};
  result.metrics.erase("try_again");
  return result;
}

}  // namespace rugae
