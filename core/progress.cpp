#include "core/progress.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>

#include "core/check.h"

namespace rugae {
namespace {

volatile std::sig_atomic_t interrupted = 0;

void on_interrupt(int) {
  if (interrupted) _exit(130);
  interrupted = 1;
}

}  // namespace

double peak_rss_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;  // Linux counts KiB
}

Progress::Progress(Output output)
    : silent_(output == Output::silent), terminal_(isatty(STDERR_FILENO) != 0) {}

Progress::~Progress() {
  if (open_ && terminal_ && !silent_) std::fputc('\n', stderr);
}

void Progress::catch_interrupts() {
  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, on_interrupt);
}

void Progress::begin(std::string stage, std::size_t total) {
  if (open_) end();
  stage_ = std::move(stage);
  done_ = 0;
  total_ = total;
  start_ = drawn_ = Clock::now();
  open_ = true;
  if (watcher_) watcher_(stage_, done_, total_);
}

void Progress::step(std::size_t steps) {
  done_ += steps;
  if (watcher_) watcher_(stage_, done_, total_);
  if (interrupted) throw Interrupted("stopped on request");
  constexpr std::chrono::milliseconds kRedraw{100};
  if (terminal_ && !silent_ && Clock::now() - drawn_ > kRedraw) {
    drawn_ = Clock::now();
    draw(false, {});
  }
}

void Progress::end(const std::string& remark) {
  if (!open_) return;
  open_ = false;
  if (watcher_) watcher_(stage_, done_, total_);
  const std::chrono::duration<double> seconds = Clock::now() - start_;
  stages_.push_back({stage_, seconds.count(), peak_rss_mb()});
  if (!silent_) draw(true, remark);
}

void Progress::split_off(std::string stage, double seconds) {
  check(!open_ && !stages_.empty(), "progress: nothing ended that {} was part of", stage);
  StageTime& whole = stages_.back();
  whole.seconds -= seconds;
  stages_.push_back({std::move(stage), seconds, whole.peak_rss_mb});
}

void Progress::say(const std::string& line) {
  if (silent_) return;
  std::fprintf(stderr, "%s%s\n", terminal_ ? "\r\033[K" : "", line.c_str());
  std::fflush(stderr);
}

void Progress::draw(bool last, const std::string& remark) {
  const double seconds = std::chrono::duration<double>(Clock::now() - start_).count();
  std::string line = fmt::format("{:<24}", stage_);
  if (total_ > 0) line += fmt::format(" {:>6}/{:<6}", done_, total_);
  line += fmt::format(" {:7.1f} s", seconds);
  if (!last && total_ > 0 && done_ > 0)
    line += fmt::format(", {:.0f} s left", seconds * static_cast<double>(total_ - done_) / done_);
  if (last && total_ > 0 && seconds > 0.0)
    line += fmt::format(", {:.1f} a second", done_ / seconds);
  if (!remark.empty()) line += "; " + remark;
  std::fprintf(stderr, "%s%s%s", terminal_ ? "\r\033[K" : "", line.c_str(), last ? "\n" : "");
  std::fflush(stderr);
}

}  // namespace rugae
