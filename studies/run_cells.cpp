#include "studies/run_cells.h"

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <map>
#include <memory>
#include <set>
#include <thread>

#include "cameras/camera.h"
#include "core/check.h"
#include "core/files.h"
#include "recon/preprocess/preprocess.h"
#include "studies/discard.h"
#include "studies/make_cell.h"
#include "studies/process.h"
#include "studies/time_left.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr double kFreeShare = 0.8;  // of the memory that is free, where no budget is given
constexpr auto kPoll = std::chrono::milliseconds(50);
constexpr int kBadInput = 2, kStopped = 130;  // exit codes of the program

double free_memory_gb() {
  std::ifstream file("/proc/meminfo");
  std::string word;
  double kib = 0.0;
  while (file >> word)
    if (word == "MemAvailable:") file >> kib;
  return kib / (1024.0 * 1024.0);
}

double pixels_of(const Camera& camera) {
  return static_cast<double>(camera.lens.width) * camera.lens.height;
}

// What the cell will make that others may want as well.
std::set<fs::path> shared_parts(const CellJob& job) {
  std::set<fs::path> parts;
  for (const fs::path& dataset : {job.files.dataset, job.files.frames})
    if (!dataset_finished(dataset)) parts.insert(dataset);
  if (!job.files.motion.empty() && !fs::exists(job.files.motion)) parts.insert(job.files.motion);
  if (!job.files.calibration.empty()) parts.insert(job.files.calibration);
  parts.insert(job.files.metrics);
  return parts;
}

// What the program said, without its own name before it.
std::string without_name(const std::string& line) {
  const std::string name = "rugae: ";
  return line.starts_with(name) ? line.substr(name.size()) : line;
}

struct Running {
  const CellJob* job = nullptr;
  std::unique_ptr<Process> process;
  std::set<fs::path> makes;
  double memory_gb = 0.0;
};

std::string in_words(double seconds_left) {
  const double minutes = seconds_left / 60.0;
  return minutes < 1.5 ? fmt::format("{:.0f} s left", seconds_left)
                       : fmt::format("{:.0f} min left", minutes);
}

class Workers {
 public:
  // `all` cells of the study, finished ones as well.
  Workers(const std::vector<CellJob>& all, const fs::path& study, const fs::path& out,
          const RunOptions& options, Progress& progress)
      : all_(all), study_(study), out_(out), options_(options), progress_(progress) {
    if (options_.memory_gb <= 0.0) options_.memory_gb = kFreeShare * free_memory_gb();
  }

  void run(std::vector<CellJob> waiting) {
    TimeLeft time_left(waiting);
    for (const CellJob& job : waiting) memory_gb_[job.index] = memory_gb_of(job);
    const auto start = Clock::now();
    progress_.begin("cells", waiting.size());
    while (!waiting.empty() || !running_.empty()) {
      start_what_fits(waiting, time_left);
      std::this_thread::sleep_for(kPoll);
      progress_.step(0);  // throws when a stop is wished; the processes end with `running_`
      for (auto at = running_.begin(); at != running_.end();) {
        if (!at->process->has_ended()) {
          ++at;
          continue;
        }
        finish(*at);
        discard_finished(all_);
        time_left.made(*at->job);
        const double elapsed_s = std::chrono::duration<double>(Clock::now() - start).count();
        progress_.step();
        progress_.say(fmt::format("  {}: {:.0f} s, {:.1f} GB{}", at->job->cell.title(),
                                  at->process->ended().seconds,
                                  at->process->ended().peak_rss_mb / 1024.0,
                                  waiting.empty() && running_.size() == 1
                                      ? ""
                                      : "; " + in_words(time_left.seconds_left(elapsed_s))));
        at = running_.erase(at);
      }
    }
    progress_.end();
  }

 private:
  void start_what_fits(std::vector<CellJob>& waiting, TimeLeft& time_left) {
    for (std::size_t i = 0;
         i < waiting.size() && static_cast<int>(running_.size()) < options_.jobs;) {
      if (waiting[i].files.finished() && is_free(shared_parts(waiting[i]))) {
        progress_.step();  // another cell of this run was the same
        time_left.skipped(waiting[i]);
        waiting.erase(waiting.begin() + static_cast<std::ptrdiff_t>(i));
        continue;
      }
      if (!may_start(waiting[i])) {
        ++i;
        continue;
      }
      start(waiting[i]);
      waiting.erase(waiting.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }

  bool is_free(const std::set<fs::path>& parts) const {
    return std::ranges::none_of(running_, [&](const Running& r) {
      return std::ranges::any_of(parts, [&](const fs::path& p) { return r.makes.contains(p); });
    });
  }

  // One may always run, whatever it needs.
  bool may_start(const CellJob& job) const {
    if (running_.empty()) return true;
    if (job.study->alone || running_.front().job->study->alone) return false;
    double used_gb = memory_gb_.at(job.index);
    for (const Running& r : running_) used_gb += r.memory_gb;
    return used_gb <= options_.memory_gb && is_free(shared_parts(job));
  }

  fs::path log_of(const CellJob& job) const {
    return out_ / "logs" / (job.files.metrics.stem().string() + ".log");
  }

  void start(const CellJob& job) {
    make_folder(out_ / "logs");
    const unsigned cores = std::max(1u, std::thread::hardware_concurrency());
    const unsigned at_a_time = job.study->alone ? 1u : static_cast<unsigned>(options_.jobs);
    const unsigned threads = std::max(1u, cores / at_a_time);
    kept_.push_back(std::make_unique<CellJob>(job));
    const std::vector<std::string> command = {options_.program.string(),
                                              "run",
                                              study_.string(),
                                              "--out",
                                              out_.string(),
                                              "--cell",
                                              std::to_string(job.index),
                                              "--parent",
                                              std::to_string(getpid()),
                                              "--threads",
                                              std::to_string(threads)};
    running_.push_back({kept_.back().get(), std::make_unique<Process>(command, log_of(job)),
                        shared_parts(job), memory_gb_.at(job.index)});
  }

  void finish(const Running& r) {
    const Ended& ended = r.process->ended();
    if (ended.success()) {
      check(r.job->files.finished() || fs::exists(r.job->files.metrics),
            "{}: the cell ended without metrics; its output is in {}", r.job->cell.title(),
            log_of(*r.job).string());
      return;
    }
    if (WIFEXITED(ended.status)) {
      const int code = WEXITSTATUS(ended.status);
      const std::string said = without_name(last_line_of(log_of(*r.job)));
      if (code == kStopped) throw Interrupted("stopped on request");
      if (code == kBadInput) fail("{}", said);
    }
    write_failure(
        r.job->files,
        fmt::format("the process of this cell ended with {}{}; its output is in {}", ended.how(),
                    WIFSIGNALED(ended.status) && WTERMSIG(ended.status) == SIGKILL
                        ? " (no memory left?)"
                        : "",
                    log_of(*r.job).string()),
        true);
  }

  const std::vector<CellJob>& all_;
  fs::path study_, out_;
  RunOptions options_;
  Progress& progress_;
  std::map<int, double> memory_gb_;  // by CellJob::index: asked for at every look
  std::vector<Running> running_;
  std::vector<std::unique_ptr<CellJob>> kept_;
};

}  // namespace

void RunOptions::check() const {
  rugae::check(jobs >= 1, "jobs is {}, expected at least 1", jobs);
  rugae::check(memory_gb >= 0.0, "memory_gb is {}, expected at least 0 (0: what is free)",
               memory_gb);
}

int frames_of(const CellJob& job) {
  constexpr int kTrajectories = 6;  // in the paper
  const auto& simulate = job.study->variants[job.cell.variant].simulate;
  const int whole = simulate.frames > 0
                        ? simulate.frames
                        : load_camera(job.cell.camera).frames_in_paper / kTrajectories;
  return simulate.first > 0 ? std::min(simulate.first, whole) : whole;
}

double memory_gb_of(const CellJob& job) {
  constexpr double kFixedGb = 0.4, kGbAPixel = 1.6e-6, kBytesInGb = 1e9;
  constexpr double kHeldBytesAPixel = 1.125;  // of each frame, by FrameSource
  const double pixels = pixels_of(load_camera(job.cell.camera));
  const double held = std::min(static_cast<double>(FrameSource::kMostHeldBytes),
                               kHeldBytesAPixel * pixels * frames_of(job));
  return kFixedGb + kGbAPixel * pixels + held / kBytesInGb;
}

void run_cells(const std::vector<CellJob>& jobs, const fs::path& study_file, const fs::path& out,
               const RunOptions& options, Progress& progress) {
  options.check();
  discard_finished(jobs);  // what a killed run left
  std::vector<CellJob> waiting;
  for (const CellJob& job : jobs)
    if (!job.files.finished()) waiting.push_back(job);
  if (options.jobs > 1 && waiting.size() > 1 && !options.program.empty()) {
    Workers(jobs, study_file, out, options, progress).run(std::move(waiting));
    return;
  }
  for (const CellJob& job : waiting) {
    if (job.files.finished()) continue;  // another cell of this run was the same
    make_cell(*job.study, job.cell, job.files, progress);
    discard_finished(jobs);
  }
}

}  // namespace rugae
