#pragma once
// Comma-separated values with a header line, numbers and plain words, no quoting.

#include <filesystem>
#include <string>
#include <vector>

namespace rugae {

struct CsvLine {
  int number = 0;  // in the file, from 1
  std::vector<std::string> cells;
};

/// The lines below the header; throws Error with file and line when the header is not `header` or a
/// line has another number of cells.
std::vector<CsvLine> read_csv(const std::filesystem::path& file, const std::string& header);
/// The cell as a finite number; throws Error with file and line otherwise.
double csv_number(const std::filesystem::path& file, const CsvLine& line, std::size_t cell);

}  // namespace rugae
