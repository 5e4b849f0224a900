#pragma once
// Gates as JUnit XML, which build servers show as tests.

#include <string>
#include <vector>

#include "studies/gates.h"

namespace rugae {

/// One test suite named `title`: a test case a cell, which fails with the reason why the cell has
/// no metrics, and one a gate; a gate that failed has its line as failure.
std::string junit_xml(const std::string& title, const std::vector<CellResult>& cells,
                      const std::vector<GateOutcome>& gates);

}  // namespace rugae
