#pragma once
// The program as a process that a test may send signals to.

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace rugae {

/// Its id. It runs in `folder`; what it says goes to `said` there.
inline pid_t start_program(const std::filesystem::path& folder,
                           const std::vector<std::string>& arguments,
                           const std::string& said = "/dev/null") {
  const pid_t child = fork();
  if (child != 0) return child;
  std::vector<std::string> words = {RUGAE_PROGRAM};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  const bool ready = chdir(folder.c_str()) == 0 && freopen(said.c_str(), "w", stderr) &&
                     freopen("/dev/null", "w", stdout);
  if (ready) execv(pointers[0], pointers.data());
  _exit(127);
}

/// Its exit code; -1 where a signal ended it.
inline int wait_for(pid_t child) {
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/// Has it said by now that Ctrl-C is its own affair (proc(5), SigCgt)? Before that Ctrl-C just ends
/// it.
inline bool handles_interrupt(pid_t child) {
  std::ifstream status("/proc/" + std::to_string(child) + "/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("SigCgt:"))
      return std::stoull(line.substr(line.find_last_of(" \t") + 1), nullptr, 16) >> (SIGINT - 1) &
             1;
  return false;
}

}  // namespace rugae
