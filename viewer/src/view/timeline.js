// The path's error over time, and the cursor on it.

import {element, svgElement} from "../dom.js";

const kWidth = 1000, kHeight = 40;
const kPlayStep_ms = 140;

// The error as an area, with gaps where frames were lost; these as a shade.
function errorCurve({time_s, error_mm}) {
  const last = time_s[time_s.length - 1] || 1, worst = Math.max(...error_mm.filter(Number.isFinite), 1e-9);
  const x = (i) => ((kWidth * time_s[i]) / last).toFixed(1), y = (e) => (kHeight - 0.92 * kHeight * (e / worst)).toFixed(1);
  let area = "", run = [];
  const close = () => {
    if (run.length) area += `M${x(run[0])} ${kHeight}` + run.map((i) => `L${x(i)} ${y(error_mm[i])}`).join("") +
      `L${x(run[run.length - 1])} ${kHeight}Z`;
    run = [];
  };
  const svg = svgElement("svg", {viewBox: `0 0 ${kWidth} ${kHeight}`, preserveAspectRatio: "none", "aria-hidden": "true"});
  const half = (0.5 * kWidth) / Math.max(time_s.length - 1, 1);
  error_mm.forEach((error, i) => {
    if (Number.isFinite(error)) return run.push(i);
    close();
    svg.append(svgElement("rect", {class: "lost", x: x(i) - half, y: 0, width: 2 * half, height: kHeight}));
  });
  close();
  svg.append(svgElement("path", {class: "error", d: area}));
  return svg;
}

export class Timeline {
  /** Calls `onMove(k)` when the reader asks for stop `k`. `path` has lists of time_s and error_mm. */
  constructor(path, stops, onMove) {
    this.onMove = onMove;
    this.count = stops.length;
    this.share = stops.map((stop) => path.time_s[stop.index] / (path.time_s[path.time_s.length - 1] || 1));
    this.slider = element("input", {type: "range", min: 0, max: stops.length - 1, value: 0, step: 1,
                                    "aria-label": "place along the path", oninput: () => this.move(Number(this.slider.value))});
    this.playButton = element("button", {type: "button", class: "play", "aria-label": "play", onclick: () => this.toggle()});
    this.here = element("i", {class: "here"});
    const curve = element("div", {class: "error-curve", title: "path error over time",
                                  onclick: (event) => this.moveToShare(event)}, errorCurve(path), this.here);
    this.root = element("div", {class: "view-timeline"}, this.playButton, element("div", {class: "view-track"}, curve, this.slider));
  }

  move(k) {
    this.stop();
    this.onMove(Math.min(Math.max(k, 0), this.count - 1));
  }

  moveToShare(event) {
    const box = event.currentTarget.getBoundingClientRect(), share = (event.clientX - box.left) / box.width;
    const off = this.share.map((s) => Math.abs(s - share));
    this.move(off.indexOf(Math.min(...off)));
  }

  /** The cursor is at stop `k` now. */
  show(k, text) {
    this.slider.value = k;
    this.slider.setAttribute("aria-valuetext", text);
    this.here.style.left = `${100 * this.share[k]}%`;
  }

  toggle() {
    if (this.timer) return this.stop();
    this.playButton.classList.add("playing");
    this.timer = setInterval(() => {
      if (!this.root.isConnected || !this.root.offsetParent) return this.stop();  // its cell was closed
      this.onMove((Number(this.slider.value) + 1) % this.count);
    }, kPlayStep_ms);
  }

  stop() {
    clearInterval(this.timer);
    this.timer = null;
    this.playButton.classList.remove("playing");
  }
}
