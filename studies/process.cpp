#include "studies/process.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>

#include "core/check.h"
#include "core/files.h"

namespace rugae {

bool Ended::success() const { return WIFEXITED(status) && WEXITSTATUS(status) == 0; }

std::string Ended::how() const {
  return WIFSIGNALED(status) ? fmt::format("signal {}", WTERMSIG(status))
                             : fmt::format("exit code {}", WEXITSTATUS(status));
}

Process::Process(const std::vector<std::string>& command, const std::filesystem::path& log)
    : name_(command.at(0)), start_(std::chrono::steady_clock::now()) {
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
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  posix_spawnattr_setpgroup(&attributes, 0);
  const int error =
      posix_spawnp(&child_, arguments[0], &files, &attributes, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  posix_spawnattr_destroy(&attributes);
  check(error == 0, "'{}' cannot be started: {}", name_, std::strerror(error));
  running_ = true;
}

Process::~Process() {
  try {
    stop();
  } catch (const Error&) {
    running_ = false;  // it is not ours to wait for any more
  }
}

bool Process::wait(int options) {
  rusage usage{};
  const pid_t done = wait4(child_, &ended_.status, options, &usage);
  if (done != child_) {
    check(done == 0 || errno == EINTR, "'{}': {}", name_, std::strerror(errno));
    return false;
  }
  running_ = false;
  ended_.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  ended_.peak_rss_mb = static_cast<double>(usage.ru_maxrss) / 1024.0;
  return true;
}

bool Process::has_ended() { return !running_ || wait(WNOHANG); }

void Process::stop() {
  if (!running_) return;
  kill(-child_, SIGTERM);
  while (!wait(0)) {
  }
}

std::string last_line_of(const std::filesystem::path& log) {
  std::string said = read_text(log);
  while (!said.empty() && said.back() == '\n') said.pop_back();
  const std::size_t last = said.rfind('\n');
  return last == std::string::npos ? said : said.substr(last + 1);
}

}  // namespace rugae
