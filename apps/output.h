#pragma once
// What commands print.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>

namespace rugae {

/// Machine-readable on request, else lines for people.
inline void print(bool json, const nlohmann::ordered_json& result, const std::string& text) {
  std::printf("%s\n", json ? result.dump(2).c_str() : text.c_str());
}

inline void add_json_flag(CLI::App& command, bool& json) {
  command.add_flag("--json", json, "Print the result as JSON");
}

}  // namespace rugae
