#include "studies/junit.h"

#include <fmt/format.h>

#include <algorithm>

#include "studies/html.h"

namespace rugae {

namespace {

std::string test_case(const std::string& group, const std::string& name,
                      const std::string& failure) {
  const std::string start = fmt::format("  <testcase classname=\"{}\" name=\"{}\"",
                                        html::escape(group), html::escape(name));
  return failure.empty() ? start + "/>\n"
                         : fmt::format("{}><failure message=\"{}\"/></testcase>\n", start,
                                       html::escape(failure));
}

std::string failure_of(const CellResult& cell) { return cell.metrics.value("failed", ""); }

}  // namespace

std::string junit_xml(const std::string& title, const std::vector<CellResult>& cells,
                      const std::vector<GateOutcome>& gates) {
  const auto failed =
      std::ranges::count(gates, false, &GateOutcome::passed) +
      std::ranges::count_if(cells, [](const auto& c) { return !failure_of(c).empty(); });
  std::string xml = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<testsuite name=\"{}\" tests=\"{}\" failures=\"{}\">\n",
      html::escape(title), cells.size() + gates.size(), failed);
  for (const CellResult& cell : cells)
    xml += test_case(cell.cell.title(), "runs", failure_of(cell));
  for (const GateOutcome& gate : gates)
    xml += test_case(gate.cell, gate.metric + " " + gate.expected, gate.passed ? "" : gate.line());
  return xml + "</testsuite>\n";
}

}  // namespace rugae
