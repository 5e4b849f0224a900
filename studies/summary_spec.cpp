#include "studies/summary_spec.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "core/check.h"
#include "studies/published.h"

namespace rugae {
namespace {

const std::vector<std::string> kLists = {"camera", "trajectory", "method", "seed"};

std::vector<std::string> names_of(const std::vector<Axis>& axes) {
  std::vector<std::string> names = kLists;
  for (const Axis& axis : axes) names.push_back(axis.path);
  return names;
}

void read_difference(YamlReader& yaml, const std::string& key, const std::vector<Axis>& axes,
                     std::string& what) {
  yaml.get(key, what);
  const std::vector<std::string> names = names_of(axes);
  check(std::ranges::count(names, what) > 0, "{}: {} is '{}', expected one of: {}{}",
        yaml.where(key), key, what, fmt::join(names, ", "), did_you_mean(what, names));
}

const Axis& read_axis(YamlReader& yaml, const std::vector<Axis>& axes, std::string& over) {
  yaml.require("over", over);
  std::vector<std::string> paths;
  for (const Axis& axis : axes) paths.push_back(axis.path);
  const auto axis = std::ranges::find(axes, over, &Axis::path);
  check(axis != axes.end(), "{}: over is '{}', expected an axis of the study{}", yaml.where("over"),
        over, did_you_mean(over, paths));
  return *axis;
}

template <typename Spec>
void read_what(YamlReader& yaml, Spec& spec) {
  yaml.require("title", spec.title);
  yaml.require("metric", spec.metric);
  yaml.get("unit", spec.unit);
  yaml.get("scale", spec.scale);
}

TableSpec read_table(YamlReader yaml, const std::vector<Axis>& axes,
                     const std::vector<std::string>& methods) {
  TableSpec table;
  read_what(yaml, table);
  read_difference(yaml, "rows", axes, table.rows);
  read_difference(yaml, "columns", axes, table.columns);
  yaml.get("published", table.published);
  const std::vector<std::string> known = published_tables();
  check(table.published.empty() || std::ranges::count(known, table.published) > 0,
        "{}: published is '{}', expected one of: {}{}", yaml.where("published"), table.published,
        fmt::join(known, ", "), did_you_mean(table.published, known));
  yaml.get("method", table.method);
  check(table.method.empty() || std::ranges::count(methods, table.method) > 0,
        "{}: method is '{}', expected one of: {}{}", yaml.where("method"), table.method,
        fmt::join(methods, ", "), did_you_mean(table.method, methods));
  yaml.finish();
  return table;
}

CurveSpec read_curve(YamlReader yaml, const std::vector<Axis>& axes) {
  CurveSpec curve;
  read_what(yaml, curve);
  for (const std::string& value : read_axis(yaml, axes, curve.over).names())
    check(number_in(value).has_value(), "{}: the axis '{}' has the value '{}', expected numbers",
          yaml.where("over"), curve.over, value);
  read_difference(yaml, "lines", axes, curve.lines);
  yaml.finish();
  return curve;
}

BarsSpec read_bars(YamlReader yaml, const std::vector<Axis>& axes) {
  BarsSpec bars;
  read_what(yaml, bars);
  read_axis(yaml, axes, bars.over);
  yaml.finish();
  return bars;
}

FindingSpec::Side read_side(YamlReader& finding, const std::string& key,
                            const std::vector<Axis>& axes) {
  auto yaml = finding.child(key);
  check(yaml && yaml->keys().size() == 1,
        "{}: {} expected one of what cells differ in and its value, such as {{method: paper}}",
        finding.where(key), key);
  FindingSpec::Side side;
  side.what = yaml->keys()[0];
  side.value = yaml->text(side.what);
  const std::vector<std::string> names = names_of(axes);
  check(std::ranges::count(names, side.what) > 0, "{}: '{}', expected one of: {}{}",
        yaml->where(side.what), side.what, fmt::join(names, ", "), did_you_mean(side.what, names));
  for (const Axis& axis : axes)
    check(axis.path != side.what || std::ranges::count(axis.names(), side.value) > 0,
          "{}: '{}' is no value of the axis '{}': {}", yaml->where(side.what), side.value,
          axis.path, fmt::join(axis.names(), ", "));
  return side;
}

FindingSpec read_finding(YamlReader yaml, const std::vector<Axis>& axes) {
  FindingSpec finding;
  yaml.require("claim", finding.claim);
  yaml.require("metric", finding.metric);
  finding.more = read_side(yaml, "more", axes);
  finding.less = read_side(yaml, "less", axes);
  check(finding.more.what == finding.less.what,
        "{}: less is of '{}' and more of '{}', expected one", yaml.where("less"), finding.less.what,
        finding.more.what);
  yaml.finish();
  return finding;
}

}  // namespace

SummarySpecs read_summaries(YamlReader& study, const std::vector<Axis>& axes,
                            const std::vector<std::string>& methods) {
  SummarySpecs specs;
  for (YamlReader& yaml : study.children("tables"))
    specs.tables.push_back(read_table(yaml, axes, methods));
  for (YamlReader& yaml : study.children("curves")) specs.curves.push_back(read_curve(yaml, axes));
  for (YamlReader& yaml : study.children("bars")) specs.bars.push_back(read_bars(yaml, axes));
  for (YamlReader& yaml : study.children("findings"))
    specs.findings.push_back(read_finding(yaml, axes));
  return specs;
}

}  // namespace rugae
