#pragma once
// Progress of long work: a line with time left on a terminal, one line a stage elsewhere; and the
// wish to stop.

#include <chrono>
#include <cstddef>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace rugae {

struct StageTime {
  std::string name;
  double seconds = 0.0;
  double peak_rss_mb = 0.0;  // of the whole process, at the end of the stage
};

/// The most memory that the process has held so far.
double peak_rss_mb();

class Progress {
 public:
  enum class Output { automatic, silent };
  explicit Progress(Output output = Output::automatic);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Ends the stage before and begins one of `total` steps (0 if not known).
  void begin(std::string stage, std::size_t total = 0);
  /// Counts steps done; throws Interrupted after Ctrl-C. Not thread-safe: call it from the thread
  /// that began.
  void step(std::size_t steps = 1);
  /// Ends the current stage; `remark` is added to its line, such as "57 of 60 key frames".
  void end(const std::string& remark = {});

  /// Of the stage that ended last, `seconds` were those of a stage of this name: both took turns.
  void split_off(std::string stage, double seconds);

  /// A line of its own, without ending the stage.
  void say(const std::string& line);

  /// Called at each begin, step and end of a stage, with what is done of `total` steps.
  using Watcher =
      std::function<void(const std::string& stage, std::size_t done, std::size_t total)>;
  void watch(Watcher watcher) { watcher_ = std::move(watcher); }

  const std::vector<StageTime>& stages() const { return stages_; }

  /// Makes Ctrl-C set a flag that step() turns into Interrupted; the second Ctrl-C ends the process
  /// at once.
  static void catch_interrupts();

 private:
  void draw(bool last, const std::string& remark);

  using Clock = std::chrono::steady_clock;
  bool silent_ = false;
  bool terminal_ = false;
  bool open_ = false;
  std::string stage_;
  std::size_t done_ = 0, total_ = 0;
  Clock::time_point start_, drawn_;
  std::vector<StageTime> stages_;
  Watcher watcher_;
};

}  // namespace rugae
