#pragma once
// Plots that the page's viewer draws from their numbers; where it is absent a table stands instead.
//
// Each is a <figure class="plot"> with <script type="application/json" class="plot">, holding
//   {"kind": "lines", "title", "x": {"label"}, "y": {"label"},
//    "series": [{"name", "x": [..], "y": [..], "low": [..] | null, "high": [..] | null}],
//    "marks": [{"x", "label"}]}
//   {"kind": "bars", "title", "unit", "bars": [{"name", "value", "low" | null, "high" | null}]}
// and the same numbers as a table. What is not finite is null, and a gap in the plot.
// Names, labels, titles and units are plain text.

#include <limits>
#include <string>
#include <vector>

namespace rugae {

/// A curve with an optional band around it.
struct PlotSeries {
  std::string name;
  std::vector<double> x, y;       // of one length
  std::vector<double> low, high;  // the band, such as a 95 % interval: as long as `y`, or empty
};
/// A line across the plot at a value of x, such as a breakdown point.
struct PlotMark {
  double x = 0.0;
  std::string label;
};
struct LinesPlot {
  std::string title, x_label, y_label;  // labels with their units
  std::vector<PlotSeries> series;
  std::vector<PlotMark> marks = {};
};

struct PlotBar {
  std::string name;
  double value = std::numeric_limits<double>::quiet_NaN();
  // Ends of its interval; not finite: none.
  double low = std::numeric_limits<double>::quiet_NaN();
  double high = std::numeric_limits<double>::quiet_NaN();
};
struct BarsPlot {
  std::string title, unit;
  std::vector<PlotBar> bars;  // from top to bottom
};

/// HTML. Throws Error naming the plot's title and the series when arrays differ in length.
std::string plot_html(const LinesPlot& plot);
std::string plot_html(const BarsPlot& plot);

}  // namespace rugae
