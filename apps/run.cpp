// rugae run: the whole loop over a study.

#include <sys/prctl.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <memory>
#include <opencv2/core/utility.hpp>
#include <optional>
#include <thread>

#include "apps/commands.h"
#include "apps/output.h"
#include "core/check.h"
#include "core/presets.h"
#include "core/progress.h"
#include "studies/study.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;

// As long as it lives no more than so many threads work; 0: as many as there are processors.
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads) {
    if (threads <= 0) return;
    limit_.emplace(tbb::global_control::max_allowed_parallelism, threads);
    cv::setNumThreads(threads);
  }

 private:
  std::optional<tbb::global_control> limit_;
};

}  // namespace

void add_run(CLI::App& app, int& exit_code) {
  struct Arguments {
    fs::path study, out;
    RunOptions options;
    int cell = -1, threads = 0;
    pid_t parent = 0;
    bool json = false;
  };
  const auto a = std::make_shared<Arguments>();
  a->options.jobs = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  CLI::App& command =
      *app.add_subcommand("run", "The whole loop over a study: tables and a report");
  command.add_option("study", a->study, "STUDY.yaml or a preset's name")->required();
  command.add_option("--out", a->out, "The study's folder; a run that was stopped goes on there")
      ->required();
  command.add_option("--jobs", a->options.jobs, "Cells at a time, as far as the memory goes")
      ->capture_default_str();
  command
      .add_option("--memory-gb", a->options.memory_gb, "Memory for all of them; 0: what is free")
      ->capture_default_str();
  command.add_option("--threads", a->threads, "Threads of a cell; 0: all processors")
      ->capture_default_str();
  // What the command itself starts.
  command.add_option("--cell", a->cell)->group("");
  command.add_option("--parent", a->parent)->group("");
  add_json_flag(command, a->json);
  command.callback([a, &exit_code] {
    const ThreadLimit limit(a->threads);
    const fs::path study = find_preset("studies", "study", a->study.string());
    Progress::catch_interrupts();
    Progress progress;
    if (a->cell >= 0) {
      prctl(PR_SET_PDEATHSIG, SIGKILL);    // a cell does not outlive the study that started it
      if (getppid() != a->parent) return;  // it has ended already
      run_one_cell(study, a->out, a->cell, progress);
      return;
    }
    a->options.program = fs::read_symlink("/proc/self/exe");
    const StudyResult result = run_study(study, a->out, a->options, progress);
    for (const std::string& cell : result.failed_cells)
      std::fprintf(stderr, "cell failed: %s\n", cell.c_str());
    for (const std::string& gate : result.failed_gates)
      std::fprintf(stderr, "gate failed: %s\n", gate.c_str());
    constexpr int kNotAsAsked = 3;
    if (!result.failed_gates.empty() || !result.failed_cells.empty()) exit_code = kNotAsAsked;
    print(a->json,
          {{"cells", result.cells},
           {"failed_cells", result.failed_cells},
           {"failed_gates", result.failed_gates},
           {"report", result.report.string()}},
          fmt::format("{} cells, {} failed, {} gates failed, report: {}", result.cells,
                      result.failed_cells.size(), result.failed_gates.size(),
                      result.report.string()));
  });
}

}  // namespace rugae
