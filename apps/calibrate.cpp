#include "recon/calibrate.h"

#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "apps/commands.h"
#include "core/check.h"
#include "core/files.h"
#include "core/units.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct Arguments {
  std::vector<fs::path> inputs;
  std::string board, model;
  fs::path out;
  CalibrationOptions options;
  bool json = false;
};

// "6x7": inner corners across and down.
void read_board(const std::string& text, CalibrationOptions& options) {
  if (text.empty()) return;
  int read = 0;
  const int fields = std::sscanf(text.c_str(), "%dx%d%n", &options.columns, &options.rows, &read);
  check(fields == 2 && read == static_cast<int>(text.size()),
        "--board is '{}', expected inner corners such as 6x7", text);
}

void read_model(const std::string& text, CalibrationOptions& options) {
  if (text.empty()) return;
  const std::vector<std::string> names = {"brown_conrady", "kannala_brandt"};
  const auto it = std::ranges::find(names, text);
  check(it != names.end(), "--model is '{}', expected one of: {}{}", text, fmt::join(names, ", "),
        did_you_mean(text, names));
  options.model = static_cast<LensModel>(it - names.begin());
}

Json to_json(const CalibrationResult& result) {
  const Lens& lens = result.lens;
  Json json = {
      {"columns", result.columns},
      {"rows", result.rows},
      {"images_used", result.used},
      {"mean_reprojection_px", result.mean_px},
      {"rms_reprojection_px", result.rms_px},
      {"lens",
       {{"model", lens.model == LensModel::brown_conrady ? "brown_conrady" : "kannala_brandt"},
        {"width", lens.width},
        {"height", lens.height},
        {"fx", lens.fx},
        {"fy", lens.fy},
        {"cx", lens.cx},
        {"cy", lens.cy},
        {"k1", lens.k1},
        {"k2", lens.k2},
        {"k3", lens.k3},
        {"k4", lens.k4},
        {"p1", lens.p1},
        {"p2", lens.p2}}}};
  for (const CalibrationImage& image : result.images)
    json["images"].push_back({{"file", image.file.string()},
                              {"used", image.used},
                              {"reason", image.reason},
                              {"mean_px", image.mean_px},
                              {"rms_px", image.rms_px}});
  for (const ModelTrial& trial : result.trials)
    json["models"].push_back({{"name", trial.name},
                              {"mean_px", trial.mean_px},
                              {"rms_px", trial.rms_px},
                              {"refused", trial.refused}});
  return json;
}

std::string to_text(const CalibrationResult& result, const fs::path& out) {
  std::string text;
  for (const CalibrationImage& image : result.images)
    text += image.used ? fmt::format("{}: {:.3f} px\n", image.file.string(), image.mean_px)
                       : fmt::format("{}: not used: {}\n", image.file.string(), image.reason);
  for (const ModelTrial& trial : result.trials)
    text += fmt::format(
        "{}: {}\n", trial.name,
        trial.refused.empty() ? fmt::format("{:.3f} px", trial.mean_px) : trial.refused);
  return text + fmt::format(
                    "{}: {} of {} images, board {} x {}, mean re-projection error {:.3f} px, "
                    "f {:.2f} {:.2f}, centre {:.2f} {:.2f} px",
                    out.string(), result.used, result.images.size(), result.columns, result.rows,
                    result.mean_px, result.lens.fx, result.lens.fy, result.lens.cx, result.lens.cy);
}

}  // namespace

void add_calibrate(CLI::App& app) {
  const auto a = std::make_shared<Arguments>();
  CLI::App& command = *app.add_subcommand("calibrate", "Chessboard images -> lens");
  command.add_option("images", a->inputs, "Folders of images, or images")->required();
  command.add_option("--board", a->board,
                     "Inner corners across and down, such as 6x7; searched for if not given");
  command.add_option("--square-mm", a->options.square_mm, "Side of a square")
      ->capture_default_str();
  command.add_option("--model", a->model,
                     "brown_conrady or kannala_brandt; the better one if not given");
  command.add_option("--out", a->out, "camera.yaml")->required();
  command.add_flag("--json", a->json, "Print the result as JSON");
  command.callback([a] {
    read_board(a->board, a->options);
    read_model(a->model, a->options);
    if (a->out.has_parent_path()) make_folder(a->out.parent_path());
    std::vector<fs::path> pictures;
    for (const fs::path& input : a->inputs) {
      const auto found = pictures_in(input);
      pictures.insert(pictures.end(), found.begin(), found.end());
    }
    const CalibrationResult result = calibrate(pictures, a->options);
    write_atomic(a->out,
                 lens_yaml(result.lens,
                           fmt::format("{} chessboard images, mean re-projection error {:.3f} px",
                                       result.used, result.mean_px)));
    const std::string text = a->json ? to_json(result).dump(2) : to_text(result, a->out);
    std::printf("%s\n", text.c_str());
  });
}

}  // namespace rugae
