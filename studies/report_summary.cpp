// What the study asks to have made of its cells: tables with the published numbers beside ours,
// findings, curves and bars.

#include <cmath>

#include "core/check.h"
#include "studies/data_plots.h"
#include "studies/html.h"
#include "studies/published.h"
#include "studies/report_parts.h"

namespace rugae {
namespace {

std::string title_of(const std::string& title, const std::string& unit) {
  return unit.empty() ? title : fmt::format("{} ({})", title, unit);
}

// What people call a camera; trajectories by their files' names; values as they are.
std::string called(const std::string& what, const std::string& value) {
  if (what == "camera") return published_camera(stem(value));
  return what == "trajectory" ? stem(value) : value;
}

std::string with_interval(const Repeats& r) {
  if (!std::isfinite(r.half_width)) return html::number(r.mean);
  return fmt::format("{} <small>&plusmn; {}</small>", html::number(r.mean),
                     html::number(r.half_width, 2));
}

// Ours, the published number, and ours over it.
std::string entry_html(const TableEntry& entry) {
  std::string text = with_interval(entry.ours);
  if (entry.published)
    text += fmt::format("<br><small>published {}, ratio {}</small>", html::number(*entry.published),
                        html::number(entry.ours.mean / *entry.published, 2));
  if (entry.failed > 0) text += fmt::format("<br><small>{} failed</small>", entry.failed);
  return text;
}

std::string table_html(const SummaryTable& table) {
  html::Table out;
  out.sortable = true;
  out.head = {html::escape(table.spec.rows)};
  for (const std::string& column : table.columns)
    out.head.push_back(html::escape(called(table.spec.columns, column)));
  for (std::size_t r = 0; r < table.rows.size(); ++r) {
    std::vector<std::string> row{html::escape(called(table.spec.rows, table.rows[r]))};
    for (const TableEntry& entry : table.entries[r]) row.push_back(entry_html(entry));
    out.rows.push_back(row);
  }
  std::string note = "<code>" + html::escape(table.spec.metric) + "</code>";
  if (!table.spec.published.empty())
    note += "; published: " + html::escape(published_source(table.spec.published));
  return "<h4>" + html::escape(title_of(table.spec.title, table.spec.unit)) +
         "</h4><p class=\"intro\">" + note + "</p>\n" + out.str();
}

std::string findings_html(const std::vector<SummaryFinding>& findings) {
  if (findings.empty()) return {};
  html::Table out;
  out.head = {"Finding", "", "ratio", "95 % interval", "pairs", "of"};
  for (const SummaryFinding& f : findings) {
    const std::string verdict = f.verdict();
    const std::string css = verdict == "confirmed" ? "pass" : verdict == "refuted" ? "fail" : "";
    std::string pairs = std::to_string(f.pairs);
    if (f.failed > 0) pairs += fmt::format(", {} not measured", f.failed);
    out.rows.push_back(
        {html::escape(f.spec.claim), fmt::format("<b class=\"{}\">{}</b>", css, verdict),
         html::number(f.ratio, 3), html::number(f.low, 3) + " to " + html::number(f.high, 3), pairs,
         fmt::format("<code>{}</code><br><small>{} over {}</small>", html::escape(f.spec.metric),
                     html::escape(f.spec.more.value), html::escape(f.spec.less.value))});
  }
  return "<h4>Findings</h4><p class=\"intro\">A claim that a metric is larger there than here: "
         "confirmed or refuted where the interval of the mean ratio is on one side of 1.</p>\n" +
         out.str();
}

std::string curve_html(const SummaryCurve& curve) {
  LinesPlot plot{title_of(curve.spec.title, curve.spec.unit), curve.spec.over, curve.spec.unit, {}};
  std::string breaks;
  for (const CurveLine& line : curve.lines) {
    PlotSeries series{called(curve.spec.lines, line.name), line.x, {}, {}, {}};
    for (const TableEntry& e : line.y) {
      series.y.push_back(e.ours.mean);
      series.low.push_back(e.ours.mean - e.ours.half_width);
      series.high.push_back(e.ours.mean + e.ours.half_width);
    }
    if (line.breaks_between) {
      plot.marks.push_back({line.breaks_between->second, series.name + " is broken"});
      breaks += fmt::format("<b>{}</b> breaks between {:g} and {:g}. ", html::escape(series.name),
                            line.breaks_between->first, line.breaks_between->second);
    }
    plot.series.push_back(std::move(series));
  }
  return plot_html(plot) + (breaks.empty() ? "" : "<p class=\"intro\">" + breaks + "</p>\n");
}

std::string bars_html(const SummaryBars& bars) {
  BarsPlot plot{bars.spec.title, bars.spec.unit, {}};
  for (std::size_t i = 0; i < bars.names.size(); ++i) {
    const Repeats& r = bars.entries[i].ours;
    plot.bars.push_back({bars.names[i], r.mean, r.mean - r.half_width, r.mean + r.half_width});
  }
  return plot_html(plot);
}

}  // namespace

std::string summary_part(const Summary& summary) {
  std::string out;
  for (const SummaryTable& table : summary.tables) out += table_html(table);
  out += findings_html(summary.findings);
  for (const SummaryCurve& curve : summary.curves) out += curve_html(curve);
  for (const SummaryBars& bars : summary.bars) out += bars_html(bars);
  return out;
}

}  // namespace rugae
