#include "studies/study.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/check.h"
#include "core/files.h"
#include "core/presets.h"
#include "studies/gates.h"
#include "studies/junit.h"
#include "studies/make_cell.h"
#include "studies/repeats.h"
#include "studies/report.h"
#include "studies/tables.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;

std::vector<CellJob> jobs_of(const Study& study, const fs::path& out) {
  std::vector<CellJob> jobs;
  for (const StudyOptions& part : study.parts)
    for (const Cell& cell : cells_of(part))
      jobs.push_back({&part, cell, files_of(part, cell, out), static_cast<int>(jobs.size())});
  return jobs;
}

StudyPart part_of(const StudyOptions& options, const std::vector<CellJob>& jobs) {
  StudyPart part{options, {}, {}, {}};
  for (const CellJob& job : jobs)
    if (job.study == &options) part.cells.push_back(read_cell(job.cell, job.files));
  part.gates = hold_gates(options.gates, part.cells);
  part.summary = summarise(options.summaries, part.cells);
  return part;
}

void write_tables(const fs::path& folder, const StudyPart& part) {
  const std::string before = part.options.name.empty() ? "" : part.options.name + "_";
  int number = 0;
  for (const SummaryTable& table : part.summary.tables) {
    make_folder(folder);
    write_atomic(folder / fmt::format("{}{}.csv", before, ++number), table_csv(table));
  }
}

}  // namespace

StudyResult run_study(const fs::path& study_file, const fs::path& out, const RunOptions& options,
                      Progress& progress) {
  const fs::path file = find_preset("studies", "study", study_file.string());
  const Study study = read_study(file);
  make_folder(out);
  const std::vector<CellJob> jobs = jobs_of(study, out);
  run_cells(jobs, file, out, options, progress);

  std::vector<StudyPart> parts;
  for (const StudyOptions& part : study.parts) parts.push_back(part_of(part, jobs));
  write_atomic(out / "results.json", results_json(study, parts).dump(1) + "\n");
  write_atomic(out / "times.json", times_json(parts).dump(1) + "\n");
  write_atomic(out / "table.csv", table_csv(all_cells(parts)));
  const bool seeds = std::ranges::any_of(parts, [](const auto& p) { return p.has_seeds(); });
  if (seeds) write_atomic(out / "repeats.csv", repeats_csv(all_cells(parts)));
  // Those of an earlier run that asked for others.
  fs::remove_all(out / "tables");
  if (!seeds) fs::remove(out / "repeats.csv");
  for (const StudyPart& part : parts) write_tables(out / "tables", part);
  write_atomic(out / "junit.xml", junit_xml(study.title, all_cells(parts), all_gates(parts)));
  StudyResult result;
  result.report = out / "report.html";
  write_atomic(result.report, report_html(study, parts, progress));
  progress.end(result.report.string());

  for (const StudyPart& part : parts)
    for (const CellResult& cell : part.cells) {
      ++result.cells;
      if (cell.metrics.contains("failed"))
        result.failed_cells.push_back(
            fmt::format("{}: {}", cell.cell.title(), cell.metrics["failed"].get<std::string>()));
    }
  for (const GateOutcome& gate : all_gates(parts))
    if (!gate.passed) result.failed_gates.push_back(gate.line());
  return result;
}

void run_one_cell(const fs::path& study_file, const fs::path& out, int index, Progress& progress) {
  const Study study = read_study(find_preset("studies", "study", study_file.string()));
  const std::vector<CellJob> jobs = jobs_of(study, out);
  check(index >= 0 && index < static_cast<int>(jobs.size()), "cell {}, expected 0 to {}", index,
        jobs.size() - 1);
  const CellJob& job = jobs[static_cast<std::size_t>(index)];
  make_cell(*job.study, job.cell, job.files, progress);
}

}  // namespace rugae
