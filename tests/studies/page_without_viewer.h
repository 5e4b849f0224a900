#pragma once
// What C++ wrote of a page: its viewer's libraries are left out.

#include <string>

namespace rugae {

inline std::string without_viewer(std::string page) {
  const std::string end = "</script>";
  const auto from = page.find("<script class=\"viewer\">");
  if (from != std::string::npos) page.erase(from, page.find(end, from) + end.size() - from);
  return page;
}

}  // namespace rugae
