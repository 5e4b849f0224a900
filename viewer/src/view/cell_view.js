// The view of one cell: a stage, the frame at the cursor, the timeline, and what ties them together.

import {element} from "../dom.js";
import {onThemeChange, pageColour} from "../theme.js";
import {float32, points} from "./bytes.js";
import {Capsule} from "./capsule.js";
import {pathsOf} from "./paths.js";
import {Pictures} from "./pictures.js";
import {Stage} from "./stage.js";
import {mapOf, wallOf} from "./surfaces.js";
import {Timeline} from "./timeline.js";
import {colourBar, toggle} from "./tools.js";

const kNear_px = 40;  // of a click to the path
const kSteps = {ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageUp: -10, PageDown: 10};

function unpacked(path) {
  return {
    time_s: [...float32(path.time_s)],
    error_mm: [...float32(path.error_mm)],
    truth_mm: points(path.truth_mm),
    estimate_mm: points(path.estimate_mm),
    worst_mm: path.worst_mm,
  };
}

export class CellView {
  /** Fills `place`; `data` and `wall` are as studies/report_view.cpp writes them. */
  constructor(place, data, wall) {
    place.view = this;  // so that a console reaches it
    this.data = data;
    this.path = unpacked(data.path);
    this.eye = false;  // looking from the capsule
    const host = element("div", {class: "view-host", role: "img", "aria-label": "the stomach in three dimensions"});
    this.stage = new Stage(host, (x, y) => this.goNear(x, y));
    this.wall = wallOf(wall, data.wall.seen);
    this.map = data.map && mapOf(data.map, data.error_colours);
    this.paths = pathsOf(this.path, data.error_colours);
    this.capsule = new Capsule(data.corner_rays);
    this.stage.scene.add(this.wall, this.paths, this.capsule.group);
    if (this.map) this.stage.scene.add(this.map);

    this.facts = element("div", {class: "view-facts", "aria-live": "off"});
    this.pictures = new Pictures(data.labels);
    this.timeline = new Timeline(this.path, data.stops, (k) => this.show(k));
    const stage = element("div", {class: "view-stage"}, host, this.tools(), this.legend());
    place.append(stage, element("div", {class: "view-side"}, this.facts, this.pictures.root), this.timeline.root);
    place.tabIndex = 0;
    place.addEventListener("keydown", (event) => this.key(event));

    this.paleWall();
    this.tint();
    onThemeChange(() => this.tint());
    this.wall.geometry.computeBoundingSphere();
    this.stage.frame(this.wall.geometry.boundingSphere);
    this.show(Math.floor((data.stops.length - 1) / 3));
  }

  tools() {
    const part = (name, object) => toggle(name, true, (on) => {
      object.visible = on;
      this.paleWall();
      this.stage.invalidate();
    });
    this.eyeButton = toggle("From the capsule", false, (on) => this.look(on));
    const back = element("button", {type: "button", class: "pill", onclick: () => this.look(false, true)}, "Whole organ");
    return element("div", {class: "view-tools"}, part("Wall", this.wall), this.map ? part("Map", this.map) : "",
                   part("Paths", this.paths), element("span", {class: "gap"}), this.eyeButton, back);
  }

  legend() {
    const {map, error_colours: colours} = this.data;
    const tracked = this.path.error_mm.some(Number.isFinite);
    const line = (name, text) => element("span", {class: "line-key"}, element("i", {class: name}), text);
    this.wallKey = element("div", {}, line("true", "true path"), line("seen", this.data.wall.moves ? "wall seen, at rest" : "wall seen"),
                          line("unseen", "never seen"));
    return element("div", {class: "view-legend"},
                   map ? colourBar("map: distance to the wall", colours, map.worst_mm) : "",
                   tracked ? colourBar("estimated path: error", colours, this.path.worst_mm) : "",
                   this.wallKey);
  }

  paleWall() {
    const pale = Boolean(this.map?.visible);
    this.wall.pale(pale);
    this.wallKey.classList.toggle("pale", pale);
  }

  tint() {
    this.wall.tint(pageColour("--rose"));
    this.paths.tint(pageColour("--ink"));
    this.capsule.tint(pageColour("--ink"), pageColour("--teal"));
    this.stage.invalidate();
  }

  /** Moves the cursor to stop `k`. */
  show(k) {
    const stop = this.data.stops[k];
    this.at = k;
    this.capsule.show(stop);
    this.pictures.show(stop.pictures, (frame) => {
      this.capsule.project(frame);
      this.stage.invalidate();
    });
    const error = this.path.error_mm[stop.index];
    const off = Number.isFinite(error) ? `path off by ${error.toPrecision(3)} mm`
      : this.path.error_mm.some(Number.isFinite) ? "lost: no estimate here" : "no estimate of the path";
    const where = `frame ${stop.index} \u00b7 ${this.path.time_s[stop.index].toFixed(2)} s`;
    this.facts.replaceChildren(element("b", {}, where), element("span", {}, off));
    this.timeline.show(k, `${where}, ${off}`);
    if (this.eye) this.stage.lookFrom(stop.pose, this.data.corner_rays);
    this.stage.invalidate();
  }

  /** From the capsule, or as before; `whole` shows the whole organ again. */
  look(fromCapsule, whole = false) {
    const leaving = this.eye && !fromCapsule;
    this.eye = fromCapsule;
    this.eyeButton.setAttribute("aria-pressed", String(fromCapsule));
    this.capsule.group.visible = !fromCapsule;
    if (fromCapsule) this.stage.lookFrom(this.data.stops[this.at].pose, this.data.corner_rays);
    else if (leaving || whole) this.stage.frame(this.wall.geometry.boundingSphere);
  }

  goNear(x, y) {
    if (!this.paths.visible) return;
    let best = null, least = kNear_px;
    this.data.stops.forEach((stop, k) => {
      const estimate = this.path.estimate_mm[stop.index];
      for (const point of [this.path.truth_mm[stop.index], estimate]) {
        const at = point.every(Number.isFinite) && this.stage.onScreen(point);
        const distance = at ? Math.hypot(at[0] - x, at[1] - y) : Infinity;
        if (distance < least) [best, least] = [k, distance];
      }
    });
    if (best !== null) this.timeline.move(best);
  }

  key(event) {
    if (event.target.matches("input") || event.altKey || event.ctrlKey || event.metaKey) return;
    const {length} = this.data.stops;
    if (event.key in kSteps) this.timeline.move(this.at + kSteps[event.key]);
    else if (event.key === "Home") this.timeline.move(0);
    else if (event.key === "End") this.timeline.move(length - 1);
    else if (event.key === "Escape" && this.eye) this.look(false);
    else return;
    event.preventDefault();
  }
}
