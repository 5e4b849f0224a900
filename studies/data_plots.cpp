#include "studies/data_plots.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/check.h"
#include "studies/html.h"

namespace rugae {
namespace {

using Json = nlohmann::ordered_json;

Json number_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(); }

Json list(const std::vector<double>& values) {
  Json out = Json::array();
  for (const double value : values) out.push_back(number_or_null(value));
  return out;
}

// "1.5 (1.2 to 1.9)"
std::string with_interval(double value, double low, double high) {
  constexpr int kDigits = 4;
  std::string text = html::number(value, kDigits);
  if (std::isfinite(low) && std::isfinite(high))
    text += fmt::format(" <small>({} to {})</small>", html::number(low, kDigits),
                        html::number(high, kDigits));
  return text;
}

std::string figure(const Json& data, const html::Table& table) {
  return "<figure class=\"plot\">" + html::json_script("plot", data.dump()) + table.str() +
         "</figure>\n";
}

void check_series(const std::string& title, const PlotSeries& s) {
  check(s.x.size() == s.y.size(), "plot '{}', series '{}': {} values of x, {} of y", title, s.name,
        s.x.size(), s.y.size());
  for (const auto* band : {&s.low, &s.high})
    check(band->empty() || band->size() == s.y.size(),
          "plot '{}', series '{}': a band of {} values, expected {} or none", title, s.name,
          band->size(), s.y.size());
}

}  // namespace

std::string plot_html(const LinesPlot& plot) {
  Json data = {{"kind", "lines"},
               {"title", plot.title},
               {"x", {{"label", plot.x_label}}},
               {"y", {{"label", plot.y_label}}},
               {"series", Json::array()},
               {"marks", Json::array()}};
  html::Table table;
  table.caption = html::escape(plot.title);
  table.head = {"", html::escape(plot.x_label), html::escape(plot.y_label)};
  for (const PlotSeries& s : plot.series) {
    check_series(plot.title, s);
    const bool band = !s.low.empty() && !s.high.empty();
    data["series"].push_back({{"name", s.name},
                              {"x", list(s.x)},
                              {"y", list(s.y)},
                              {"low", band ? list(s.low) : Json()},
                              {"high", band ? list(s.high) : Json()}});
    for (std::size_t i = 0; i < s.x.size(); ++i)
      table.rows.push_back(
          {html::escape(s.name), html::number(s.x[i], 4),
           band ? with_interval(s.y[i], s.low[i], s.high[i]) : html::number(s.y[i], 4)});
  }
  for (const PlotMark& mark : plot.marks) {
    data["marks"].push_back({{"x", number_or_null(mark.x)}, {"label", mark.label}});
    table.rows.push_back({html::escape(mark.label), html::number(mark.x, 4), ""});
  }
  return figure(data, table);
}

std::string plot_html(const BarsPlot& plot) {
  Json data = {
      {"kind", "bars"}, {"title", plot.title}, {"unit", plot.unit}, {"bars", Json::array()}};
  html::Table table;
  table.caption = html::escape(plot.title);
  table.head = {"", html::escape(plot.unit)};
  for (const PlotBar& bar : plot.bars) {
    data["bars"].push_back({{"name", bar.name},
                            {"value", number_or_null(bar.value)},
                            {"low", number_or_null(bar.low)},
                            {"high", number_or_null(bar.high)}});
    table.rows.push_back({html::escape(bar.name), with_interval(bar.value, bar.low, bar.high)});
  }
  return figure(data, table);
}

}  // namespace rugae
