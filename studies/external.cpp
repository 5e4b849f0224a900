#include "studies/external.h"

#include <fcntl.h>
#include <fmt/ranges.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <map>
#include <thread>

#include "core/check.h"
#include "core/files.h"
#include "dataset/estimate.h"
#include "dataset/layout.h"
#include "dataset/observations.h"
#include "dataset/ply_io.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;

constexpr double kTimeShare = 0.01;  // of the time between frames, that a pose's time may be off

const std::vector<std::string> kWords = {"frames", "frame_list", "calibration", "out"};

// Every {word} of the argument by what `value` says of it.
template <typename Value>
std::string replaced(const std::string& argument, const Value& value) {
  std::string out;
  for (std::size_t from = 0;;) {
    const std::size_t open = argument.find('{', from);
    const std::size_t close = argument.find('}', open == std::string::npos ? from : open);
    if (open == std::string::npos || close == std::string::npos) return out + argument.substr(from);
    out += argument.substr(from, open - from) + value(argument.substr(open + 1, close - open - 1));
    from = close + 1;
  }
}

struct Ended {
  int status = 0;  // of waitpid
  double seconds = 0.0, peak_rss_mb = 0.0;
};

// Both outputs go to `log`. A wish to stop ends the program, and all that it started.
Ended run(const std::vector<std::string>& command, const fs::path& log, Progress& progress) {
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC,
                                   0644);
  posix_spawn_file_actions_adddup2(&files, STDOUT_FILENO, STDERR_FILENO);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);  // a group of its own
  posix_spawnattr_setpgroup(&attributes, 0);
  const auto start = std::chrono::steady_clock::now();
  pid_t child = 0;
  const int error =
      posix_spawnp(&child, arguments[0], &files, &attributes, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  posix_spawnattr_destroy(&attributes);
  check(error == 0, "'{}' cannot be started: {}", command[0], std::strerror(error));
  Ended ended;
  rusage usage{};
  for (;;) {
    const pid_t done = wait4(child, &ended.status, WNOHANG, &usage);
    if (done == child) break;
    check(done == 0 || errno == EINTR, "'{}': {}", command[0], std::strerror(errno));
    try {
      progress.step(0);
    } catch (const Interrupted&) {
      kill(-child, SIGTERM);
      wait4(child, &ended.status, 0, &usage);
      throw;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  ended.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  ended.peak_rss_mb = static_cast<double>(usage.ru_maxrss) / 1024.0;
  return ended;
}

void check_success(const std::string& program, int status, const fs::path& log) {
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return;
  const std::string how = WIFSIGNALED(status) ? fmt::format("signal {}", WTERMSIG(status))
                                              : fmt::format("exit code {}", WEXITSTATUS(status));
  std::string said = read_text(log);
  while (!said.empty() && said.back() == '\n') said.pop_back();
  const std::size_t last_line = said.rfind('\n');
  if (last_line != std::string::npos) said = said.substr(last_line + 1);
  fail("'{}' ended with {}; its output is in {}{}", program, how, log.string(),
       said.empty() ? ", empty" : ", the last line: " + said);
}

// The frame whose time is that of the pose.
std::size_t frame_at(double time_s, const std::vector<double>& times_s, const fs::path& file) {
  const auto distance = [time_s](double t) { return std::abs(t - time_s); };
  const auto nearest = std::ranges::min_element(times_s, {}, distance);
  const double step_s = times_s.size() > 1 ? (times_s.back() - times_s.front()) /
                                                 static_cast<double>(times_s.size() - 1)
                                           : 1.0;
  check(distance(*nearest) <= kTimeShare * step_s,
        "{}: a pose at {} s, expected the times of frames, the nearest is {} s", file.string(),
        time_s, *nearest);
  return static_cast<std::size_t>(nearest - times_s.begin());
}

Estimate estimate_from(const fs::path& results, const Observations& observations) {
  Estimate e;
  e.lens = observations.lens();
  for (int i = 0; i < observations.size(); ++i) e.times_s.push_back(observations.time_s(i));
  e.states.assign(e.times_s.size(), FrameState::lost);
  e.world_from_camera.assign(e.times_s.size(), Rigid3{});
  const fs::path trajectory = results / "trajectory.txt";
  for (const TimedPose& pose : read_tum(trajectory)) {
    const std::size_t frame = frame_at(pose.time_s, e.times_s, trajectory);
    check(e.states[frame] == FrameState::lost, "{}: two poses at {} s", trajectory.string(),
          pose.time_s);
    e.states[frame] = FrameState::resected;
    e.world_from_camera[frame] = pose.world_from_camera;
  }
  if (fs::exists(results / "map.ply")) e.map = read_ply(results / "map.ply");
  return e;
}

}  // namespace

void ExternalMethod::check(const std::string& where) const {
  rugae::check(!command.empty() && !command[0].empty(), "{}: method '{}' names no program", where,
               name);
  for (const std::string& argument : command)
    replaced(argument, [&](const std::string& word) {
      rugae::check(std::ranges::count(kWords, word) > 0,
                   "{}: '{{{}}}' in the command of '{}', expected one of: {{{}}}{}", where, word,
                   name, fmt::join(kWords, "}, {"), did_you_mean(word, kWords));
      return word;
    });
}

void reconstruct_by(const ExternalMethod& method, const fs::path& dataset, const fs::path& estimate,
                    Progress& progress) {
  const DatasetLayout layout{fs::absolute(dataset)};
  const Observations observations = Observations::open(dataset);
  const fs::path results = fs::absolute(estimate) / "results", log = estimate / "command.log";
  make_folder(results);
  const std::map<std::string, std::string> values = {{"frames", layout.frames().string()},
                                                     {"frame_list", layout.frame_list().string()},
                                                     {"calibration", layout.calibration().string()},
                                                     {"out", results.string()}};
  std::vector<std::string> command;
  for (const std::string& argument : method.command)
    command.push_back(replaced(argument, [&](const std::string& word) { return values.at(word); }));
  progress.begin(method.name);
  const Ended ended = run(command, log, progress);
  check_success(command[0], ended.status, log);
  Estimate made = estimate_from(results, observations);
  made.method = method.name;
  made.stages = {{method.name, ended.seconds, ended.peak_rss_mb}};
  write_estimate(estimate, made);
  progress.end(fmt::format("{} of {} frames", made.track().size(), observations.size()));
}

}  // namespace rugae
