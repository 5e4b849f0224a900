// Plots from the JSON that studies/data_plots.h describes; the table beside the data stays, folded away.

import * as Plot from "@observablehq/plot";

import {element} from "./dom.js";

const kColours = ["var(--rose)", "var(--teal)", "#8d6cab", "#c98a1b", "#4d7fb8", "#7d8b3a", "#b0577f", "#6b7280"];
const kHeight_px = 300, kBar_px = 30;

const finite = (value) => typeof value === "number";
const shown = (value) => Number(value.toPrecision(4)).toString();

/** Points of a series as rows; a null y is a gap, a null x is nowhere. */
function pointsOf(series) {
  return series.flatMap((s) =>
    s.x.flatMap((x, i) =>
      finite(x) ? [{name: s.name, x, y: s.y[i] ?? NaN, low: s.low?.[i] ?? NaN, high: s.high?.[i] ?? NaN}] : []));
}

/** Which end of a text stands at x. */
function anchorOf(x, points) {
  const all = points.map((p) => p.x);
  return 2 * x > Math.min(...all) + Math.max(...all) ? "end" : "start";
}

function linesPlot(data, width) {
  const points = pointsOf(data.series);
  const names = data.series.map((s) => s.name);
  const marks = data.marks.filter((mark) => finite(mark.x));
  return Plot.plot({
    width,
    height: kHeight_px,
    marginLeft: 54,
    marginBottom: 44,
    marginTop: marks.length ? 34 : 24,
    marginRight: 24,
    x: {label: data.x.label, nice: true},
    y: {label: data.y.label, grid: true, nice: true, zero: true},
    color: {domain: names, range: names.map((_, i) => kColours[i % kColours.length])},
    marks: [
      Plot.ruleY([0], {strokeOpacity: 0.3}),
      Plot.areaY(points, {x: "x", y1: "low", y2: "high", fill: "name", fillOpacity: 0.16}),
      Plot.lineY(points, {x: "x", y: "y", stroke: "name", strokeWidth: 2}),
      Plot.dot(points.filter((p) => finite(p.y) && !Number.isNaN(p.y)), {x: "x", y: "y", fill: "name", r: 3}),
      Plot.ruleX(marks, {x: "x", stroke: "currentColor", strokeDasharray: "3 4", strokeOpacity: 0.7}),
      // Towards the middle, so that neither end of the plot cuts it off.
      ...["start", "end"].map((textAnchor) => Plot.text(marks.filter((mark) => anchorOf(mark.x, points) === textAnchor),
        {x: "x", text: "label", frameAnchor: "top", dy: -12, textAnchor, fill: "currentColor"})),
      Plot.tip(points, Plot.pointer({
        maxRadius: 90,
        x: "x",
        y: "y",
        title: (p) => `${p.name}\n${data.x.label}: ${shown(p.x)}\n${data.y.label}: ${shown(p.y)}` +
          (Number.isNaN(p.low) || Number.isNaN(p.high) ? "" : `\n${shown(p.low)} to ${shown(p.high)}`),
      })),
    ],
  });
}

function barsPlot(data, width) {
  const bars = data.bars.map((bar) => ({...bar, value: bar.value ?? NaN}));
  const whiskers = bars.filter((bar) => finite(bar.low) && finite(bar.high));
  const longest = Math.max(...bars.map((bar) => bar.name.length), 4);
  const text = (bar) => (Number.isNaN(bar.value) ? "not measured" : shown(bar.value));
  const end = (bar) => (Number.isNaN(bar.value) ? 0 : Math.max(bar.value, finite(bar.high) ? bar.high : 0, 0));
  return Plot.plot({
    width,
    height: 66 + kBar_px * bars.length,
    marginBottom: 40,
    marginLeft: Math.min(16 + 7 * longest, width * 0.45),
    marginRight: 64,
    x: {label: data.unit, grid: true, nice: true, zero: true},
    y: {label: null, domain: bars.map((bar) => bar.name), tickSize: 0},
    marks: [
      Plot.barX(bars.filter((bar) => !Number.isNaN(bar.value)),
                {x: "value", y: "name", fill: "var(--rose)", fillOpacity: 0.85, insetTop: 4, insetBottom: 4}),
      Plot.ruleY(whiskers, {x1: "low", x2: "high", y: "name", stroke: "currentColor", strokeWidth: 1.5}),
      Plot.tickX(whiskers.flatMap((w) => [{...w, at: w.low}, {...w, at: w.high}]),
                 {x: "at", y: "name", stroke: "currentColor", inset: 9}),
      Plot.text(bars, {x: end, y: "name", text, textAnchor: "start", dx: 7, fill: "currentColor"}),
      Plot.ruleX([0]),
    ],
  });
}

/** Only names of more than one curve need a key. */
function key(data) {
  if (data.kind !== "lines" || data.series.length < 2) return "";
  const entries = data.series.map((s, i) =>
    element("span", {}, element("i", {style: `background:${kColours[i % kColours.length]}`}), s.name));
  return element("div", {class: "plot-key"}, ...entries);
}

/** The plot as an SVG `width` px wide. Throws on a kind that is not known. */
export function drawn(data, width) {
  if (data.kind === "lines") return linesPlot(data, width);
  if (data.kind === "bars") return barsPlot(data, width);
  throw new Error(`plot '${data.title}': unknown kind '${data.kind}'`);
}

function drawFigure(figure) {
  const data = JSON.parse(figure.querySelector("script.plot").textContent);
  const table = figure.querySelector(".table");
  const place = element("div", {class: "plot-place"});
  figure.prepend(element("h4", {}, data.title), key(data), place);
  figure.append(element("details", {class: "plot-numbers"}, element("summary", {}, "the numbers"), table));
  // Also draws first when a closed cell opens: until then it has no width.
  let width = 0;
  new ResizeObserver(([entry]) => {
    const now = Math.floor(entry.contentRect.width);
    if (!now || now === width) return;
    width = now;
    place.replaceChildren(drawn(data, width));
  }).observe(place);
}

export function drawPlots(root) {
  root.querySelectorAll("figure.plot").forEach(drawFigure);
}
