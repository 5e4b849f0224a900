#pragma once
// One function a subcommand: it declares the arguments and what happens when the subcommand is
// given.

#include <CLI/CLI.hpp>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace rugae {

void add_simulate(CLI::App& app);
void add_calibrate(CLI::App& app);
void add_reconstruct(CLI::App& app);
void add_evaluate(CLI::App& app);
void add_picture(CLI::App& app);
void add_export(CLI::App& app);
void add_list(CLI::App& app);
/// These two end normally with another exit code than 0: 3 for a failed gate, 2 for a dataset with
/// problems.
void add_run(CLI::App& app, int& exit_code);
void add_check(CLI::App& app, int& exit_code);

/// What `evaluate` prints for people.
std::string summary_text(const nlohmann::json& metrics);

/// The one line for a command line that cannot be understood, with the nearest subcommand or
/// option.
std::string usage_error(const CLI::App& app, int argc, char** argv, const CLI::ParseError& error);

}  // namespace rugae
