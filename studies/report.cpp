#include "studies/report.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>

#include "core/check.h"
#include "core/files.h"
#include "core/in_lots.h"
#include "core/presets.h"
#include "dataset/image_io.h"
#include "dataset/writer.h"
#include "studies/discard.h"
#include "studies/frame_pictures.h"
#include "studies/html.h"
#include "studies/map_over_truth.h"
#include "studies/published.h"
#include "studies/report_parts.h"
#include "studies/report_view.h"

namespace rugae {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

// Fills {{name}} in the template; every name must be there, and every placeholder be filled.
std::string filled(std::string page, const std::map<std::string, std::string>& values,
                   const fs::path& file) {
  std::string out;
  std::size_t from = 0;
  for (std::size_t open = page.find("{{"); open != std::string::npos;
       open = page.find("{{", from)) {
    const std::size_t close = page.find("}}", open);
    check(close != std::string::npos, "{}: a placeholder without end", file.string());
    const std::string name = page.substr(open + 2, close - open - 2);
    const auto it = values.find(name);
    check(it != values.end(), "{}: unknown placeholder '{}'", file.string(), name);
    out.append(page, from, open - from);
    out += it->second;
    from = close + 2;
  }
  out.append(page, from);
  return out;
}

std::string counted(std::size_t n, const std::string& one, const std::string& many = "") {
  return fmt::format("{} {}", n, n == 1 ? one : many.empty() ? one + "s" : many);
}

// `first` is null where no cell's frames are kept, of several.
std::string lede(const std::vector<StudyPart>& parts, const CellView* first) {
  const StudyOptions& study = parts.front().options;
  const SimulateOptions& simulate = study.variants.front().simulate;
  const std::string scene = html::escape(stem(simulate.scene));
  const std::size_t cells = all_cells(parts).size();
  if (cells == 1 && first) {
    const Lens& lens = first->truth.camera().lens;
    return fmt::format(
        "{} frames of {} &times; {} px from a capsule camera (<b>{}</b>) on <b>trajectory {}</b>, "
        "{} cm through a simulated stomach (<b>{}</b>, {}, seed {}). The <b>{}</b> method "
        "reconstructed the path and the wall from the frames alone; here both are measured against "
        "the exact truth.",
        first->truth.size(), lens.width, lens.height,
        html::escape(published_camera(stem(first->cell.cell.camera))),
        html::escape(stem(first->cell.cell.trajectory)),
        html::number(length_mm(first->truth.track()) / 10.0, 4), scene,
        html::escape(simulate.resolution), first->cell.cell.seed,
        html::escape(first->cell.cell.method));
  }
  if (parts.size() > 1)
    return fmt::format(
        "{} cells in {} parts in a simulated stomach (<b>{}</b>, {}), each measured against the "
        "exact truth that its method never saw.",
        cells, parts.size(), scene, html::escape(simulate.resolution));
  return fmt::format(
      "{} cells: every combination of {}, {}, {}, {} and {} in a simulated stomach (<b>{}</b>, "
      "{}), each reconstructed from its frames alone and measured against the exact truth.",
      cells, counted(study.cameras.size(), "camera"),
      counted(study.trajectories.size(), "trajectory", "trajectories"),
      counted(study.variants.size(), "setting"), counted(study.seeds.size(), "seed"),
      counted(study.methods.size(), "method"), scene, html::escape(simulate.resolution));
}

std::string gates_part(const std::vector<GateOutcome>& gates) {
  if (gates.empty()) return {};
  html::Table table;
  table.head = {"Gate", "expected", "found", "", "why"};
  for (const GateOutcome& gate : gates)
    table.rows.push_back(
        {html::escape(gate.cell) + "<br><code>" + html::escape(gate.metric) + "</code>",
         html::escape(gate.expected), html::escape(gate.found),
         gate.passed ? "<b class=\"pass\">passed</b>" : "<b class=\"fail\">failed</b>",
         html::escape(gate.reason)});
  return "<section class=\"chapter\"><h2>Gates</h2>" + table.str() + "</section>\n";
}

// All cells side by side; the paper's numbers in small print.
std::string overview_part(const std::vector<CellResult>& cells) {
  html::Table table;
  table.sortable = true;
  table.head = {"Camera",         "trajectory", "method",  "ATE RMSE (mm)", "paper",
                "map error (mm)", "paper",      "tracked", "seconds"};
  for (const CellResult& cell : cells) {
    const auto at = [&](const std::string& path) {
      const json& value = metric_at(cell.metrics, path);
      return value.is_number() ? value.get<double>() : std::nan("");
    };
    const auto of_paper = [&](const std::string& table) {
      const auto v = published(table, cell.cell.trajectory, cell.cell.camera);
      return "<small>" + (v ? html::number(*v) : std::string("&ndash;")) + "</small>";
    };
    table.rows.push_back({fmt::format("<a href=\"{}\">{}</a>", html::link_to(cell.cell.name()),
                                      html::escape(published_camera(stem(cell.cell.camera)))),
                          html::escape(stem(cell.cell.trajectory)),
                          html::escape(cell.cell.method) + "<br><small>" +
                              html::escape(cell.cell.setting()) + "</small>",
                          html::number(at("trajectory.ate_sim3_rmse_mm")), of_paper("ate"),
                          html::number(at("surface.icp_aligned.accuracy_mean_mm")), of_paper("map"),
                          html::number(100.0 * at("tracking.tracked_share")) + " %",
                          html::number(at("time.reconstruct_s"))});
  }
  std::string sheet = "<div class=\"sheet\">";
  for (const CellResult& cell : cells) {
    const DatasetLayout layout{cell.dataset};
    const int frame = frame_of_sheet(cell.dataset);
    sheet += fmt::format(
        "<a href=\"{5}\"><img loading=\"lazy\" src=\"{1}\" alt=\"{0}, frame {2}\"><span>{3}, "
        "{4}</span></a>",
        html::escape(cell.cell.name()), html::jpeg(read_image_bgr(layout.frame(frame)), 300), frame,
        html::escape(published_camera(stem(cell.cell.camera))),
        html::escape(stem(cell.cell.trajectory)), html::link_to(cell.cell.name()));
  }
  return "<section class=\"chapter\"><h2>All cells</h2>" + sheet + "</div>" + table.str() +
         "</section>\n";
}

std::string chapter(const std::string& title, const std::string& intro, const std::string& body) {
  if (body.empty()) return {};
  return "<section class=\"chapter\"><h2>" + title + "</h2><p class=\"intro\">" + intro + "</p>\n" +
         body + "</section>\n";
}

std::string cell_chapters(const CellView& view, const ReportViews* views) {
  const FramePictures pictures(view, shown_frames(view));
  const MapOverTruth over = map_over_truth(view);
  const std::string explore =
      views
          ? chapter("Look around",
                    "Drag to turn, scroll or pinch to come closer, click the path to go there; the "
                    "arrow keys step along it.",
                    views->part(view, over, pictures))
          : "";
  if (view.cell.metrics.contains("failed"))
    return explore + chapter("Inside the stomach",
                             "The reconstruction gave up: " +
                                 html::escape(view.cell.metrics.at("failed").get<std::string>()),
                             frames_part(view, pictures));
  return explore +
         chapter("Inside the stomach",
                 "Frames along the path, and what the simulator knows about every pixel of them. "
                 "The reconstruction gets the first row alone. Click a picture to enlarge it.",
                 frames_part(view, pictures)) +
         chapter("From frames to a map", "What each stage of the reconstruction made of them.",
                 stages_part(view)) +
         chapter("The path", "Where the capsule was, and where the reconstruction thinks it was.",
                 path_part(view)) +
         chapter("The map", "The reconstructed wall, placed by the path, beside the true one.",
                 map_part(view, over)) +
         chapter("All numbers", "Dashes stand for what could not be measured.", tables_part(view));
}

bool has_loop(const StudyPart& part) { return part.options.measure == Measure::loop; }

// A cell whose process was killed while it simulated has nothing to show.
bool has_frames(const CellResult& cell) {
  return !cell.metrics.contains("failed") || cell.metrics.contains("simulation");
}

std::vector<CellResult> loop_cells(const std::vector<StudyPart>& parts) {
  std::vector<CellResult> cells;
  for (const StudyPart& part : parts)
    if (has_loop(part)) std::ranges::copy_if(part.cells, std::back_inserter(cells), has_frames);
  return cells;
}

std::string failures_part(const std::vector<CellResult>& cells) {
  html::Table table;
  table.head = {"Cell", "why it failed"};
  for (const CellResult& cell : cells)
    if (cell.metrics.contains("failed"))
      table.rows.push_back({html::escape(cell.cell.title()),
                            html::escape(cell.metrics.at("failed").get<std::string>())});
  return table.rows.empty() ? std::string() : chapter("Cells that failed", "", table.str());
}

Estimate estimate_of(const CellResult& cell) {
  const bool there = fs::exists(EstimateLayout{cell.estimate}.info());
  return cell.metrics.contains("failed") || !there ? Estimate{} : read_estimate(cell.estimate);
}

// Those that the study wants shown in full.
std::vector<CellResult> detailed_cells(const std::vector<StudyPart>& parts) {
  std::vector<CellResult> cells;
  for (const StudyPart& part : parts)
    if (part.options.details && has_loop(part))
      std::ranges::copy_if(part.cells, std::back_inserter(cells), has_frames);
  return cells;
}

// The head of the page: of the first cell whose frames are there, one of the whole loop if any is.
void fill_head(const std::vector<StudyPart>& parts, std::map<std::string, std::string>& values) {
  std::vector<CellResult> cells = loop_cells(parts);
  const bool loop = !cells.empty();
  if (!loop) std::ranges::copy_if(all_cells(parts), std::back_inserter(cells), has_frames);
  check(!cells.empty(), "report: no cell of the study has frames; the first failed: {}",
        all_cells(parts)[0].metrics.value("failed", "without a reason"));
  const bool many = cells.size() > 1;
  const auto first = std::ranges::find_if(
      cells, [](const CellResult& c) { return fs::exists(DatasetLayout{c.dataset}.manifest()); });
  if (first == cells.end()) {  // the study keeps none
    values["cover"] = values["cards"] = "";
    values["lede"] = lede(parts, nullptr);
    return;
  }
  const Truth truth = Truth::open(first->dataset);
  const Estimate estimate = estimate_of(*first);
  const CellView view{*first, truth, estimate, many};
  values["cover"] = "<img class=\"zoom\" src=\"" + cover_picture(view) +
                    "\" alt=\"a frame from inside the stomach\">";
  values["lede"] = lede(parts, &view);
  values["cards"] = loop && !many ? headline_cards(view) : "";
}

// The chapters of the cells; those of a single one without a fold.
std::string cells_part(const std::vector<CellResult>& cells, bool many, const ReportViews* views,
                       Progress& progress) {
  constexpr std::size_t kAtATime = 4;  // each holds a wall, a map and their pictures
  std::string out;
  make_in_lots(
      cells.size(), kAtATime, progress,
      [&](std::size_t i) {
        const CellResult& cell = cells[i];
        const Truth truth = Truth::open(cell.dataset);
        const Estimate estimate = estimate_of(cell);
        const CellView view{cell, truth, estimate, many};
        if (!many) return cell_chapters(view, views);
        return fmt::format("<details class=\"cell\" id=\"{}\"><summary>{}</summary>\n",
                           html::escape(cell.cell.name()), html::escape(cell.cell.title())) +
               headline_cards(view) + cell_chapters(view, views) + "</details>\n";
      },
      [&](std::size_t, const std::string& chapters) { out += chapters; });
  return out;
}

std::string summaries_part(const std::vector<StudyPart>& parts) {
  std::string out;
  for (const StudyPart& part : parts)
    if (const std::string body = summary_part(part.summary); !body.empty())
      out += chapter(html::escape(part.options.title), "", body);
  return out;
}

constexpr const char* kNoViewer =
    "<p class=\"note\">This page has no interactive views: <code>viewer/dist/viewer.js</code> was "
    "not "
    "there when it was written. <code>scripts/setup.sh</code> builds it.</p>";

// What viewer/build.js makes of viewer/src; empty where it was not built.
std::string viewer_bundle() {
  const fs::path file = preset_root() / "viewer" / "dist" / "viewer.js";
  return fs::exists(file) ? read_text(file) : std::string();
}

}  // namespace

std::string report_html(const Study& study, const std::vector<StudyPart>& parts,
                        Progress& progress) {
  const std::vector<CellResult> cells = all_cells(parts);
  check(!cells.empty(), "report: a study without cells");
  const fs::path file = preset_root() / "viewer" / "report.html";
  const std::string page = read_text(file);
  std::map<std::string, std::string> values;
  values["title"] = html::escape(study.title);
  fill_head(parts, values);
  const std::string viewer = viewer_bundle();
  values["viewer"] =
      viewer.empty() ? kNoViewer : "<script class=\"viewer\">" + viewer + "</script>";
  values["summaries"] = summaries_part(parts);
  const std::vector<CellResult> loop = loop_cells(parts), detailed = detailed_cells(parts);
  progress.begin("report", detailed.size());
  ReportViews views(detailed.size());
  if (!viewer.empty())
    for (const CellResult& cell : detailed) views.add_wall(Truth::open(cell.dataset).wall());
  values["cells"] = views.walls() + cells_part(detailed, loop.size() > 1,
                                               viewer.empty() ? nullptr : &views, progress);
  values["overview"] = (loop.size() > 1 ? overview_part(loop) : "") + failures_part(cells);
  values["gates"] = gates_part(all_gates(parts));
  std::string texts = study.text;
  if (parts.size() > 1)
    for (const StudyPart& part : parts)
      texts += "\n# " + part.options.name + "\n" + part.options.text;
  values["study"] = html::escape(texts);
  return filled(page, values, file);
}

}  // namespace rugae
