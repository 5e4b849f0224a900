#pragma once
// What commands print.

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>

#include "core/check.h"

namespace rugae {

/// Machine-readable on request, else lines for people.
inline void print(bool json, const nlohmann::ordered_json& result, const std::string& text) {
  const int written = std::printf("%s\n", json ? result.dump(2).c_str() : text.c_str());
  check(written > 0 && std::fflush(stdout) == 0, "standard output: cannot be written: {}",
        std::strerror(errno));
}

inline void add_json_flag(CLI::App& command, bool& json) {
  command.add_flag("--json", json, "Print the result as JSON");
}

}  // namespace rugae
