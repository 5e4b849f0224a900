#include "studies/data_plots.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/check.h"
#include "studies/html.h"
#include "tests/message_of.h"

namespace rugae {
namespace {

using nlohmann::json;

json data_of(const std::string& html) {
  const std::string open = "<script type=\"application/json\" class=\"plot\">";
  const auto begin = html.find(open), end = html.find("</script>");
  return json::parse(html.substr(begin + open.size(), end - begin - open.size()));
}

TEST(DataPlots, LinesKeepToTheirContract) {
  LinesPlot plot{"Noise", "strength", "ATE (mm)", {}, {{2.5, "breaks down"}}};
  plot.series.push_back({"paper", {0, 1, 2}, {1.5, std::nan(""), 4}, {1, 1, 3}, {2, 2, 5}});
  plot.series.push_back({"dense", {0, 1}, {0.5, 0.25}, {}, {}});
  const json expected = json::parse(R"json({
    "kind": "lines", "title": "Noise", "x": {"label": "strength"}, "y": {"label": "ATE (mm)"},
    "series": [
      {"name": "paper", "x": [0.0, 1.0, 2.0], "y": [1.5, null, 4.0],
       "low": [1.0, 1.0, 3.0], "high": [2.0, 2.0, 5.0]},
      {"name": "dense", "x": [0.0, 1.0], "y": [0.5, 0.25], "low": null, "high": null}],
    "marks": [{"x": 2.5, "label": "breaks down"}]})json");
  EXPECT_EQ(data_of(plot_html(plot)), expected);
}

TEST(DataPlots, BarsKeepToTheirContract) {
  const BarsPlot plot{"Budget", "mm", {{"poses", 3.0, 2.0, 4.0}, {"depth", 1.0}, {"noise"}}};
  const json expected = json::parse(R"json({
    "kind": "bars", "title": "Budget", "unit": "mm",
    "bars": [{"name": "poses", "value": 3.0, "low": 2.0, "high": 4.0},
             {"name": "depth", "value": 1.0, "low": null, "high": null},
             {"name": "noise", "value": null, "low": null, "high": null}]})json");
  EXPECT_EQ(data_of(plot_html(plot)), expected);
}

TEST(DataPlots, TheTableHasTheSameNumbers) {
  const std::string html = plot_html(BarsPlot{"Budget", "mm", {{"poses", 3.0, 2.0, 4.0}, {"a&b"}}});
  EXPECT_NE(html.find("<caption>Budget</caption>"), std::string::npos);
  EXPECT_NE(html.find("<td>poses</td><td>3.000 <small>(2.000 to 4.000)</small></td>"),
            std::string::npos);
  EXPECT_NE(html.find("<td>a&amp;b</td><td>&ndash;</td>"), std::string::npos);
}

TEST(DataPlots, NoTextEndsTheScript) {
  const std::string text = "</script><b>";
  const std::string html = plot_html(BarsPlot{text, "mm", {{text, 1.0}}});
  EXPECT_EQ(data_of(html).at("title"), text);
  EXPECT_EQ(html.find(text), std::string::npos);
}

TEST(DataPlots, ArraysOfOtherLengthsAreNamed) {
  LinesPlot plot{"Noise", "x", "y", {{"paper", {0, 1}, {1}, {}, {}}}};
  EXPECT_EQ(message_of([&] { plot_html(plot); }),
            "plot 'Noise', series 'paper': 2 values of x, 1 of y");
  plot.series[0] = {"paper", {0}, {1}, {1, 2}, {3}};
  EXPECT_EQ(message_of([&] { plot_html(plot); }),
            "plot 'Noise', series 'paper': a band of 2 values, expected 1 or none");
}

}  // namespace
}  // namespace rugae
