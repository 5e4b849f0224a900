#include "apps/commands.h"

#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/output.h"
#include "core/check.h"
#include "core/files.h"
#include "core/presets.h"
#include "core/progress.h"
#include "dataset/check_dataset.h"
#include "dataset/check_folder.h"
#include "dataset/export/export.h"
#include "dataset/frame_sheet.h"
#include "dataset/image_io.h"
#include "dataset/layout.h"
#include "dataset/observations.h"
#include "recon/pipeline.h"
#include "render/simulate.h"
#include "validate/evaluate.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// CLI11 reads -1 as the largest number there is where none is below zero.
CLI::Validator whole_number() {
  return {[](std::string& text) {
            const bool digits = text.find_first_not_of("0123456789") == std::string::npos;
            return digits ? std::string() : fmt::format("'{}', expected 0, 1, 2 ...", text);
          },
          ""};
}

// Each camera of a rig has a dataset of its own.
void check_no_rig(const fs::path& folder) {
  if (!fs::exists(folder / "rig.json")) return;
  std::vector<std::string> cameras;
  for (const auto& entry : fs::directory_iterator(folder))
    if (fs::exists(DatasetLayout{entry.path()}.info()))
      cameras.push_back(entry.path().filename().string());
  std::ranges::sort(cameras);
  fail("{}: the cameras of a rig, expected one of them: {}", folder.string(),
       fmt::join(cameras, ", "));
}

}  // namespace

void add_simulate(CLI::App& app) {
  struct Arguments {
    SimulateOptions options;
    fs::path out, settings;
    std::vector<std::string> changes;
    bool json = false, clean = false, no_labels = false, all_labels = false;
  };
  const auto a = std::make_shared<Arguments>();
  CLI::App& command = *app.add_subcommand(
      "simulate", "Render a dataset: frames, times, calibration and exact truth");
  command.add_option("--scene", a->options.scene, "Preset, YAML or mesh file")
      ->capture_default_str();
  command.add_option("--camera", a->options.camera, "Preset or YAML of a camera or a rig")
      ->capture_default_str();
  command.add_option("--trajectory", a->options.trajectory, "Preset 1 to 6 or YAML")
      ->capture_default_str();
  command.add_option("--resolution", a->options.resolution, "Wall detail: coarse, medium or fine")
      ->capture_default_str();
  command
      .add_option("--frames", a->options.frames,
                  "Frames over the whole path; 0: as many as in the paper")
      ->capture_default_str();
  command.add_option("--first", a->options.first,
                     "Only the first so many of them, at the same pace; 0: all");
  command.add_option("--only-frame", a->options.only_frame, "Render this frame alone")
      ->check(whole_number());
  command.add_option("--seed", a->options.seed, "Draws the stomach, the path and the noise")
      ->check(whole_number())
      ->capture_default_str();
  command.add_option("--threads", a->options.threads, "0: all processors")->capture_default_str();
  command.add_option("--options", a->settings, "YAML with the settings of light, lens and sensor");
  command.add_option("--set", a->changes, "One setting by its path, such as sensor.noise=false");
  command.add_flag("--clean", a->clean, "No sensor noise");
  auto* none = command.add_flag("--no-labels", a->no_labels, "Frames and poses only");
  command.add_flag("--all-labels", a->all_labels, "Every label image there is")->excludes(none);
  command.add_option("--out", a->out, "The dataset's folder")->required();
  add_json_flag(command, a->json);
  command.callback([a] {
    RenderSettings& render = a->options.render;
    if (!a->settings.empty()) read_settings(YamlReader::from_file(a->settings), render);
    for (const std::string& change : a->changes) change_setting(change, render);
    if (a->clean) render.sensor.noise = false;
    if (a->no_labels) render.labels = false;
    if (a->all_labels) {
      render.labels = true;
      render.truth.labels = LabelSet::all();
      render.truth.labels.indirect = render.light.bounces > 0;
    }
    Progress::catch_interrupts();
    Progress progress;
    const SimulateResult r = simulate(a->options, a->out, progress);
    const int frames = r.frames + r.skipped;
    const double rate = r.wall_s > 0.0 ? r.frames / r.wall_s : 0.0;
    const Json json = {{"dataset", a->out.string()},
                       {"frames", frames},
                       {"skipped", r.skipped},
                       {"path_length_mm", r.path_length_mm},
                       {"min_clearance_mm", r.min_clearance_mm},
                       {"frames_per_s", rate},
                       {"thread_seconds",
                        {{"trace", r.trace_s},
                         {"shade", r.shade_s},
                         {"label", r.label_s},
                         {"sensor", r.sensor_s},
                         {"encode", r.encode_s},
                         {"write", r.write_s}}}};
    print(a->json, json,
          fmt::format("{}: {} frames ({} from an earlier run), path {:.1f} mm, clearance {:.1f} "
                      "mm, {:.1f} frames a "
                      "second\nthread-seconds: trace {:.1f}, shade {:.1f}, labels {:.1f}, sensor "
                      "{:.1f}, encode {:.1f}, "
                      "write {:.1f}",
                      a->out.string(), frames, r.skipped, r.path_length_mm, r.min_clearance_mm,
                      rate, r.trace_s, r.shade_s, r.label_s, r.sensor_s, r.encode_s, r.write_s));
  });
}

void add_reconstruct(CLI::App& app) {
  struct Arguments {
    fs::path input, calibration, options_file, out;
    std::string method = "paper";
    double fps = 30.0;
    bool json = false;
  };
  const auto a = std::make_shared<Arguments>();
  CLI::App& command =
      *app.add_subcommand("reconstruct", "Estimate the path and the wall from frames alone");
  command.add_option("input", a->input, "A dataset, or a folder of images with --calibration")
      ->required();
  command.add_option("--method", a->method, "paper or dense")->capture_default_str();
  command.add_option("--calibration", a->calibration, "Lens YAML; replaces the dataset's own");
  command.add_option("--fps", a->fps, "Frame rate of a plain folder of images")
      ->capture_default_str();
  command.add_option("--options", a->options_file, "YAML with reconstruction options");
  command.add_option("--out", a->out, "The estimate's folder")->required();
  add_json_flag(command, a->json);
  command.callback([a] {
    ReconOptions options;
    if (!a->options_file.empty()) read_options(YamlReader::from_file(a->options_file), options);
    options.method = a->method;
    options.check();
    const Observations observations = Observations::open(a->input, a->calibration, a->fps);
    make_estimate_folder(a->out);
    Progress::catch_interrupts();
    Progress progress;
    const Estimate estimate = reconstruct(observations, options, a->out, progress);
    const std::size_t tracked = estimate.track().size();
    Json json = {{"estimate", a->out.string()},
                 {"frames", observations.size()},
                 {"tracked", tracked},
                 {"map_triangles", estimate.map.triangles.size()}};
    for (const auto& [name, value] : estimate.numbers) json["numbers"][name] = value;
    for (const StageTime& stage : estimate.stages)
      json["stages"].push_back(
          {{"name", stage.name}, {"seconds", stage.seconds}, {"peak_rss_mb", stage.peak_rss_mb}});
    print(a->json, json,
          fmt::format("{}: {} of {} frames tracked, map of {} triangles", a->out.string(), tracked,
                      observations.size(), estimate.map.triangles.size()));
  });
}

void add_evaluate(CLI::App& app) {
  struct Arguments {
    fs::path dataset, out;
    EstimateFiles files;
    bool json = false;
  };
  const auto a = std::make_shared<Arguments>();
  CLI::App& command =
      *app.add_subcommand("evaluate", "Measure an estimate against the exact truth");
  command.add_option("dataset", a->dataset, "The dataset with its truth")->required();
  command.add_option("estimate", a->files.trajectory,
                     "What reconstruct wrote, or a trajectory of another program: TUM, "
                     "world_from_camera, at the frames' times");
  command.add_option("--map", a->files.map, "Its map: any mesh, in the trajectory's world");
  command.add_option("--mm-per-unit", a->files.mm_per_unit, "Of trajectory, map and depth")
      ->capture_default_str();
  command.add_option("--depth", a->files.depth,
                     "Its depth along z: a folder of EXR or 16-bit PNG named by their frames");
  command
      .add_option("--depth-scale", a->files.depth_scale,
                  "Units (of the trajectory) a step of the depth files")
      ->capture_default_str();
  command.add_option("--out", a->out, "metrics.json");
  add_json_flag(command, a->json);
  command.callback([a] {
    if (a->out.has_parent_path()) make_folder(a->out.parent_path());
    Progress::catch_interrupts();
    Progress progress;
    const nlohmann::json metrics = evaluate(a->dataset, a->files, progress);
    if (!a->out.empty()) write_atomic(a->out, metrics.dump(2) + "\n");
    print(a->json, metrics, summary_text(metrics));
  });
}

void add_check(CLI::App& app, int& exit_code) {
  struct Arguments {
    fs::path dataset;
    PlainFolderOptions parts;
    bool json = false;
  };
  const auto a = std::make_shared<Arguments>();
  CLI::App& command = *app.add_subcommand(
      "check", "Is this dataset, or any folder of images, depth and poses, whole and consistent?");
  command.add_option("dataset", a->dataset, "A dataset, or a folder made by others")->required();
  command.add_option("--images", a->parts.images, "Folder of images, of a folder made by others");
  command.add_option("--depth", a->parts.depth, "Folder of depth: EXR, or 16-bit PNG");
  command
      .add_option("--depth-scale", a->parts.depth_scale, "Millimetres per unit of the depth files")
      ->check([](const std::string& word) {
        double scale = 0.0;
        const bool above = CLI::detail::lexical_cast(word, scale) && scale > 0.0;
        return above ? std::string() : "expected a number above 0, not '" + word + "'";
      });
  command.add_option("--poses", a->parts.poses, "Poses in TUM format, world_from_camera, mm");
  command.add_option("--flow", a->parts.flow, "Folder of flow to the next frame: EXR or .flo, px");
  command.add_option("--masks", a->parts.masks, "Folder of masks: not 0 where depth holds");
  command.add_option("--calibration", a->parts.calibration, "Lens YAML");
  add_json_flag(command, a->json);
  command.callback([a, &exit_code] {
    const PlainFolderOptions& p = a->parts;
    const bool told =
        p.depth_scale > 0.0 || !(p.images.empty() && p.depth.empty() && p.poses.empty() &&
                                 p.flow.empty() && p.masks.empty() && p.calibration.empty());
    check_no_rig(a->dataset);
    const bool ours = !told && fs::exists(DatasetLayout{a->dataset}.info());
    const DatasetCheck result = ours ? check_dataset(a->dataset) : check_folder(a->dataset, p);
    constexpr int kBadInput = 2;
    if (!result.problems.empty()) exit_code = kBadInput;
    std::string text;
    for (const auto* lines : {&result.problems, &result.notes})
      for (const std::string& line : *lines) text += line + "\n";
    text +=
        fmt::format("{}: {} frames, {} files, {}", a->dataset.string(), result.frames, result.files,
                    !result.problems.empty() ? fmt::format("{} problems", result.problems.size())
                    : result.notes.empty()   ? "sound"
                                             : "each of them sound");
    print(a->json,
          {{"problems", result.problems},
           {"notes", result.notes},
           {"frames", result.frames},
           {"files", result.files}},
          text);
  });
}

void add_picture(CLI::App& app) {
  struct Arguments {
    std::vector<fs::path> sources;
    fs::path out;
    int frame = 0, columns = 3, width = 400;
    bool labels = false;
  };
  const auto a = std::make_shared<Arguments>();
  CLI::App& command = *app.add_subcommand("picture", "Frames and their labels on one sheet");
  command.add_option("sources", a->sources, "Datasets, or image files by their names")->required();
  command.add_option("--frame", a->frame, "Which frame")->capture_default_str();
  command.add_option("--columns", a->columns, "Pictures side by side")->capture_default_str();
  command.add_option("--width", a->width, "Of a picture, px")->capture_default_str();
  command.add_flag("--labels", a->labels, "Every label as well as the frame");
  command.add_option("--out", a->out, "The sheet, a PNG or JPEG")->required();
  command.callback([a] {
    std::vector<SheetTile> tiles;
    for (const fs::path& dataset : a->sources) {
      if (fs::is_regular_file(dataset)) {
        tiles.push_back({dataset.stem().string(), read_image_bgr(dataset)});
        continue;
      }
      const fs::path folder = (dataset / "").parent_path();  // without a slash at the end
      const std::string name = fmt::format("{}, frame {}", folder.filename().string(), a->frame);
      tiles.push_back({name, read_image_bgr(DatasetLayout{dataset}.frame(a->frame))});
      if (!a->labels) continue;
      const std::vector<SheetTile> labels = label_tiles(dataset, a->frame);
      tiles.insert(tiles.end(), labels.begin(), labels.end());
    }
    write_image(a->out, sheet(tiles, a->columns, a->width));
  });
}

void add_export(CLI::App& app) {
  struct Arguments {
    ExportOptions options;
    fs::path dataset, out;
    bool json = false;
  };
  const auto a = std::make_shared<Arguments>();
  CLI::App& command =
      *app.add_subcommand("export", "A dataset in the layout that another program reads");
  command.add_option("dataset", a->dataset, "The dataset's folder")->required();
  command.add_option("--format", a->options.format, "One of `rugae list formats`, such as colmap")
      ->required();
  command.add_option("--depth-per-mm", a->options.depth_per_mm,
                     "Steps of depth images a millimetre; 0: as the format has it");
  command.add_option("--out", a->out, "The export's folder")->required();
  add_json_flag(command, a->json);
  command.callback([a] {
    check_no_rig(a->dataset);
    Progress::catch_interrupts();
    Progress progress;
    const ExportReport report = export_dataset(a->dataset, a->options, a->out, progress);
    std::string text =
        fmt::format("{}: {} frames as {}", a->out.string(), report.frames, a->options.format);
    for (const std::string& note : report.notes) text += "\n  " + note;
    print(a->json,
          {{"export", a->out.string()},
           {"format", a->options.format},
           {"frames", report.frames},
           {"notes", report.notes}},
          text);
  });
}

void add_list(CLI::App& app) {
  struct Arguments {
    std::string kind;
    bool json = false;
  };
  const auto a = std::make_shared<Arguments>();
  CLI::App& command = *app.add_subcommand("list", "Names of the presets, and of the formats");
  command.add_option("kind", a->kind, "scenes, cameras, rigs, trajectories, studies or formats")
      ->required();
  add_json_flag(command, a->json);
  command.callback([a] {
    const std::vector<std::string> kinds = {"scenes",       "cameras", "rigs",
                                            "trajectories", "studies", "formats"};
    check(std::ranges::count(kinds, a->kind) > 0, "list '{}': no such kind{}; known: {}", a->kind,
          did_you_mean(a->kind, kinds), fmt::join(kinds, ", "));
    if (a->kind == "formats") {
      Json all = Json::object();
      std::string text;
      for (const ExportFormat& format : export_formats()) {
        all[format.name] = format.what;
        text += fmt::format("{}{:<12}{}", text.empty() ? "" : "\n", format.name, format.what);
      }
      print(a->json, all, text);
      return;
    }
    const auto names = preset_names(a->kind == "rigs" ? "cameras/rigs" : a->kind);
    print(a->json, names, fmt::format("{}", fmt::join(names, "\n")));
  });
}

std::string usage_error(const CLI::App& app, int argc, char** argv, const CLI::ParseError& error) {
  std::vector<std::string> commands;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    commands.push_back(command->get_name());
  if (argc > 1 && std::ranges::count(commands, argv[1]) == 0 && argv[1][0] != '-')
    return fmt::format("'{}': no such command{}; known: {}", argv[1],
                       did_you_mean(argv[1], commands), fmt::join(commands, ", "));
  if (argc > 1 && std::ranges::count(commands, argv[1]) == 0)
    return fmt::format("'{}': no such option before a command; see rugae --help", argv[1]);
  if (argc < 2)
    return fmt::format("a command is missing; known: {}; see rugae --help",
                       fmt::join(commands, ", "));
  std::string text = error.what();
  // One that is required is found missing before one that is unknown, perhaps misspelt, is named.
  if (dynamic_cast<const CLI::ExtrasError*>(&error) ||
      dynamic_cast<const CLI::RequiredError*>(&error)) {
    std::vector<std::string> options;
    for (const CLI::Option* option : app.get_subcommand(argv[1])->get_options())
      for (const std::string& name : option->get_lnames()) options.push_back("--" + name);
    for (int i = 2; i < argc; ++i) {
      const std::string word = argv[i], name = word.substr(0, word.find('='));
      if (name.starts_with("--") && std::ranges::count(options, name) == 0)
        return fmt::format("{}: unknown option '{}'{}", argv[1], name, did_you_mean(name, options));
    }
  }
  return fmt::format("{}: {}; see rugae {} --help", argv[1], text, argv[1]);
}

}  // namespace rugae
