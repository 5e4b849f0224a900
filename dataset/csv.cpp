#include "dataset/csv.h"

#include <cmath>
#include <cstdlib>
#include <sstream>

#include "core/check.h"
#include "core/files.h"

namespace rugae {
namespace {

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> cells(1);
  for (const char c : line) {
    if (c == ',')
      cells.emplace_back();
    else if (c != '\r')
      cells.back() += c;
  }
  return cells;
}

}  // namespace

std::vector<CsvLine> read_csv(const std::filesystem::path& file, const std::string& header) {
  std::istringstream text(read_text(file));
  const auto names = split(header);
  std::vector<CsvLine> lines;
  std::string line;
  for (int number = 1; std::getline(text, line); ++number) {
    auto cells = split(line);
    if (number == 1) {
      check(cells == names, "{}:1: header '{}', expected '{}'", file.string(), line, header);
      continue;
    }
    if (line.empty()) continue;
    check(cells.size() == names.size(), "{}:{}: {} values, expected {} ({})", file.string(), number,
          cells.size(), names.size(), header);
    lines.push_back({number, std::move(cells)});
  }
  return lines;
}

double csv_number(const std::filesystem::path& file, const CsvLine& line, std::size_t cell) {
  const std::string& word = line.cells[cell];
  char* end = nullptr;
  const double value = std::strtod(word.c_str(), &end);
  check(!word.empty() && *end == '\0' && std::isfinite(value), "{}:{}: '{}' is not a finite number",
        file.string(), line.number, word);
  return value;
}

}  // namespace rugae
