#include "studies/calibration.h"

#include <opencv2/imgproc.hpp>
#include <vector>

#include "cameras/lens_difference.h"
#include "core/check.h"
#include "core/files.h"
#include "core/like.h"
#include "core/presets.h"
#include "dataset/frame_sheet.h"
#include "dataset/image_io.h"
#include "dataset/layout.h"
#include "recon/calibrate.h"
#include "render/simulate.h"
#include "scenes/chessboard.h"
#include "scenes/scene_file.h"

namespace rugae {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

// Raised when the same settings give other results, so that older ones are not taken for new.
constexpr int kResultsVersion = 2;
constexpr std::size_t kHashLetters = 10;

// A person holds the board still until the exposure has settled.
RenderSettings of_stills(RenderSettings render) {
  render.labels = false;
  render.truth = {};
  render.output.adc = render.output.mosaic = render.output.radiance = render.output.paired = false;
  if (render.sensor.exposure == ExposureMode::automatic)
    render.sensor.exposure = ExposureMode::per_frame;
  return render;
}

std::string text_of_chain(const std::string& kind, const std::string& what,
                          const std::string& name_or_path) {
  std::string text;
  for (const LikeFile& of : read_like_chain(kind, what, find_preset(kind, what, name_or_path)))
    text += read_text(of.file);
  return text;
}

SceneFile board_file(const CalibrationRun& run) {
  SceneFile scene = read_scene_file(find_preset("scenes", "scene", run.scene), run.seed);
  check(scene.kind == SceneKind::chessboard,
        "scene '{}' is no chessboard, from which a lens can be calibrated", run.scene);
  return scene;
}

std::string hash_of(const CalibrationRun& run, const Camera& camera, const SceneFile& scene) {
  const json key = {{"version", kResultsVersion},
                    {"camera", camera_yaml(camera)},
                    {"scene", resolved_yaml(scene)},
                    {"trajectory", text_of_chain("trajectories", "trajectory", run.trajectory)},
                    {"views", run.views},
                    {"seed", run.seed},
                    {"render", json::parse(settings_json(of_stills(run.render)))}};
  return sha256_of_bytes(key.dump()).substr(0, kHashLetters);
}

void make_views(const CalibrationRun& run, const fs::path& folder, Progress& progress) {
  SimulateOptions options;
  options.scene = run.scene;
  options.camera = run.camera;
  options.trajectory = run.trajectory;
  options.frames = run.views;
  options.seed = run.seed;
  options.threads = run.threads;
  options.render = of_stills(run.render);
  simulate(options, folder, progress);
}

cv::Point to_cv(const Vec2& pixel, double zoom) {
  return {static_cast<int>(pixel.x() * zoom), static_cast<int>(pixel.y() * zoom)};
}

// Every view with its corners, red where it was not used.
void draw_views(const CalibrationResult& result, const fs::path& file) {
  std::vector<SheetTile> tiles;
  for (const CalibrationImage& image : result.images) {
    cv::Mat picture = read_image_bgr(image.file);
    constexpr double kLeastWidth = 640.0;
    const double zoom = std::max(1.0, std::ceil(kLeastWidth / picture.cols));
    cv::resize(picture, picture, {}, zoom, zoom, cv::INTER_NEAREST);
    const cv::Scalar colour = image.used ? cv::Scalar(80, 220, 80) : cv::Scalar(60, 60, 255);
    for (const Vec2& corner : image.board.corners_px)
      cv::drawMarker(picture, to_cv(corner, zoom), colour, cv::MARKER_CROSS, 9, 1, cv::LINE_AA);
    tiles.push_back({image.used
                         ? fmt::format("{}: {:.3f} px", image.file.stem().string(), image.rms_px)
                         : image.file.stem().string() + ": " + image.reason,
                     picture});
  }
  constexpr int kColumns = 5, kTileWidth = 400;
  write_image(file, sheet(tiles, kColumns, kTileWidth));
}

// All corners of the used views over the picture: does anything go by what nobody saw?
void draw_coverage(const CalibrationResult& result, const fs::path& file) {
  constexpr double kWidth = 800.0;
  const double zoom = kWidth / result.lens.width;
  cv::Mat picture(static_cast<int>(result.lens.height * zoom), static_cast<int>(kWidth), CV_8UC3,
                  cv::Scalar::all(255));
  for (const CalibrationImage& image : result.images)
    if (image.used)
      for (const Vec2& corner : image.board.corners_px)
        cv::circle(picture, to_cv(corner, zoom), 2, cv::Scalar(160, 90, 20), cv::FILLED,
                   cv::LINE_AA);
  write_image(file, picture);
}

json metrics_of(const CalibrationResult& result, const Lens& truth) {
  const LensDifference error = compare(result.lens, truth);
  return {{"calibration",
           {{"views", result.images.size()},
            {"used_views", result.used},
            {"rms_px", result.rms_px},
            {"focal_error_share", error.focal_share},
            {"principal_point_error_px", error.principal_point_px},
            {"projection_rms_px", error.projection_rms_px},
            {"projection_corner_px", error.projection_corner_px}}}};
}

json details_of(const CalibrationResult& result) {
  json details;
  for (const CalibrationImage& image : result.images)
    details["views"].push_back({{"frame", image.file.filename().string()},
                                {"used", image.used},
                                {"reason", image.reason},
                                {"rms_px", image.rms_px}});
  for (const ModelTrial& trial : result.trials)
    details["models"].push_back(
        {{"name", trial.name}, {"rms_px", trial.rms_px}, {"refused", trial.refused}});
  return details;
}

}  // namespace

fs::path calibration_folder(const CalibrationRun& run, const fs::path& out) {
  return out / "calibrations" /
         fmt::format("{}_{}", fs::path(run.camera).stem().string(),
                     hash_of(run, load_camera(run.camera), board_file(run)));
}

CalibratedLens calibrated_lens(const CalibrationRun& run, const fs::path& out, Progress& progress) {
  const Camera camera = load_camera(run.camera);
  const SceneFile scene = board_file(run);
  const fs::path folder = calibration_folder(run, out);
  const fs::path finished = folder / "calibration.json";
  CalibratedLens made{folder / "lens.yaml", {}, fs::exists(finished)};
  if (made.kept) {
    const json all = json::parse(read_text(finished), nullptr, false);
    check(all.is_object() && all.contains("metrics"), "{}: not what a calibration writes",
          finished.string());
    made.metrics = all.at("metrics");
    return made;
  }
  make_folder(folder);
  make_views(run, folder / "board", progress);

  progress.begin("calibration");
  CalibrationOptions options;
  options.columns = scene.board.columns;
  options.rows = scene.board.rows;
  options.square_mm = scene.board.square_mm;
  CalibrationResult result =
      calibrate(pictures_in(DatasetLayout{folder / "board"}.frames()), options);
  result.lens.stop = camera.lens.stop;  // seen in any frame, but not on a board
  write_atomic(made.file,
               lens_yaml(result.lens, fmt::format("{} views of a chessboard, RMS re-projection "
                                                  "error {:.3f} px",
                                                  result.used, result.rms_px)));
  draw_views(result, folder / "views.jpg");
  draw_coverage(result, folder / "coverage.png");
  made.metrics = metrics_of(result, camera.lens);
  json all = details_of(result);
  all["metrics"] = made.metrics;
  write_atomic(finished, all.dump(1) + "\n");
  progress.end(
      fmt::format("{} of {} views, {:.3f} px", result.used, result.images.size(), result.rms_px));
  return made;
}

}  // namespace rugae
