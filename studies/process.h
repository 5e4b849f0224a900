#pragma once
// A program that runs beside this one.

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

namespace rugae {

/// How a program ended.
struct Ended {
  int status = 0;  // of waitpid
  double seconds = 0.0, peak_rss_mb = 0.0;
  bool success() const;
  std::string how() const;  // "exit code 2", "signal 9"
};

class Process {
 public:
  /// Starts it without a shell, in a process group of its own, with both outputs in `log` and
  /// nothing to read. Throws Error when it cannot be started.
  Process(const std::vector<std::string>& command, const std::filesystem::path& log);
  /// Ends the program, and all that it started, if it still runs.
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  /// Whether it has ended; does not wait.
  bool has_ended();
  /// Asks it to stop and waits.
  void stop();
  const Ended& ended() const { return ended_; }

 private:
  bool wait(int options);

  std::string name_;
  pid_t child_ = 0;
  bool running_ = false;
  std::chrono::steady_clock::time_point start_;
  Ended ended_;
};

/// The last line that is not empty; empty where there is none.
std::string last_line_of(const std::filesystem::path& log);

}  // namespace rugae
