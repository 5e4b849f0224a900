#include "studies/external.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <thread>

#include "core/check.h"
#include "core/files.h"
#include "dataset/estimate.h"
#include "dataset/foreign_estimate.h"
#include "dataset/layout.h"
#include "dataset/observations.h"
#include "dataset/ply_io.h"
#include "studies/process.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;

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

// A wish to stop ends the program, and all that it started.
Ended run(const std::vector<std::string>& command, const fs::path& log, Progress& progress) {
  Process process(command, log);
  while (!process.has_ended()) {
    progress.step(0);  // throws when that is wished, and the process is stopped
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return process.ended();
}

void check_success(const std::string& program, const Ended& ended, const fs::path& log) {
  if (ended.success()) return;
  const std::string said = last_line_of(log);
  fail("'{}' ended with {}; its output is in {}{}", program, ended.how(), log.string(),
       said.empty() ? ", empty" : ", the last line: " + said);
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

void reconstruct_by(const ExternalMethod& method, const fs::path& dataset,
                    const fs::path& calibration, const fs::path& estimate, Progress& progress) {
  const DatasetLayout layout{fs::absolute(dataset)};
  const Observations observations = Observations::open(dataset, calibration);
  const fs::path lens = calibration.empty() ? layout.calibration() : fs::absolute(calibration);
  const fs::path results = fs::absolute(estimate) / "results", log = estimate / "command.log";
  make_folder(results);
  const std::map<std::string, std::string> values = {{"frames", layout.frames().string()},
                                                     {"frame_list", layout.frame_list().string()},
                                                     {"calibration", lens.string()},
                                                     {"out", results.string()}};
  std::vector<std::string> command;
  for (const std::string& argument : method.command)
    command.push_back(replaced(argument, [&](const std::string& word) { return values.at(word); }));
  progress.begin(method.name);
  const Ended ended = run(command, log, progress);
  check_success(command[0], ended, log);
  Estimate made = estimate_of_trajectory(results / "trajectory.txt", observations.times_s(), 1.0);
  made.lens = observations.lens();
  if (fs::exists(results / "map.ply")) made.map = read_ply(results / "map.ply");
  made.method = method.name;
  made.stages = {{method.name, ended.seconds, ended.peak_rss_mb}};
  made.path_s = ended.seconds;
  write_estimate(estimate, made);
  progress.end(fmt::format("{} of {} frames", made.track().size(), observations.size()));
}

}  // namespace rugae
