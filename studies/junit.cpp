#include "studies/junit.h"

#include <fmt/format.h>

#include <algorithm>

#include "studies/html.h"

namespace rugae {

std::string junit_xml(const std::string& title, const std::vector<GateOutcome>& gates) {
  const auto failed = std::ranges::count(gates, false, &GateOutcome::passed);
  std::string xml = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<testsuite name=\"{}\" tests=\"{}\" failures=\"{}\">\n",
      html::escape(title), gates.size(), failed);
  for (const GateOutcome& gate : gates) {
    xml += fmt::format("  <testcase classname=\"{}\" name=\"{} {}\"", html::escape(gate.cell),
                       html::escape(gate.metric), html::escape(gate.expected));
    xml += gate.passed
               ? "/>\n"
               : fmt::format("><failure message=\"{}\"/></testcase>\n", html::escape(gate.line()));
  }
  return xml + "</testsuite>\n";
}

}  // namespace rugae
