#include "studies/study.h"

#include <nlohmann/json.hpp>

#include "core/files.h"
#include "core/presets.h"
#include "studies/cell.h"
#include "studies/gates.h"
#include "studies/junit.h"
#include "studies/repeats.h"
#include "studies/report.h"
#include "studies/tables.h"

namespace rugae {

StudyResult run_study(const std::filesystem::path& study_file, const std::filesystem::path& out,
                      Progress& progress) {
  const std::filesystem::path file = find_preset("studies", "study", study_file.string());
  const StudyOptions study = read_study(file);
  const std::string text = read_text(file);
  make_folder(out);

  std::vector<CellResult> cells;
  for (const Cell& cell : cells_of(study)) cells.push_back(run_cell(study, cell, out, progress));
  const std::vector<GateOutcome> gates = hold_gates(study.gates, cells);

  write_atomic(out / "results.json", results_json(study, text, cells, gates).dump(1) + "\n");
  write_atomic(out / "times.json", times_json(cells).dump(1) + "\n");
  write_atomic(out / "table.csv", table_csv(cells));
  if (study.seeds.size() > 1) write_atomic(out / "repeats.csv", repeats_csv(cells));
  write_atomic(out / "junit.xml", junit_xml(study.title, gates));
  progress.begin("report");
  StudyResult result;
  result.report = out / "report.html";
  write_atomic(result.report, report_html({study, text, cells, gates}));
  progress.end(result.report.string());

  result.cells = static_cast<int>(cells.size());
  for (const GateOutcome& gate : gates)
    if (!gate.passed) result.failed_gates.push_back(gate.line());
  return result;
}

}  // namespace rugae
