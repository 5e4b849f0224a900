#pragma once
// Numbers that others published, to stand beside ours: studies/published.yaml.

#include <optional>
#include <string>
#include <vector>

namespace rugae {

/// Names of the tables: "ate", "map", ...
std::vector<std::string> published_tables();

/// The number of a table at a row and column, in the table's unit (lengths in mm, times in s);
/// empty where it has none.
std::optional<double> published(const std::string& table, const std::string& row,
                                const std::string& column);

/// Where the table stands, such as "Turan et al. 2017, table 2".
std::string published_source(const std::string& table);

/// "Misumi-II" for "misumi-v5506": what the paper calls a camera; the name itself for others.
std::string published_camera(const std::string& camera);

/// The number a text is as a whole; empty for any other text.
std::optional<double> number_in(const std::string& text);

}  // namespace rugae
