// A small real study and its page: a small camera on a short path, 12 or 10 frames, each reconstructed and given up.

import assert from "node:assert/strict";
import {spawnSync} from "node:child_process";
import {mkdtempSync, readFileSync, rmSync, writeFileSync} from "node:fs";
import {tmpdir} from "node:os";
import {join} from "node:path";

/** Folder of the study, with out/report.html; `program` is the built rugae. */
export function makeStudy(program) {
  const folder = mkdtempSync(join(tmpdir(), "rugae_viewer_"));
  writeFileSync(join(folder, "small.yaml"), `name: small
frames_in_paper: 0
diameter_mm: 5
lens: {model: brown_conrady, width: 160, height: 120, horizontal_fov_deg: 90}
sensor: {pixel_pitch_um: 3, fps: 30, bit_depth: 10, full_well_e: 10000, read_noise_e: 5, shutter: global}
`);
  writeFileSync(join(folder, "short.yaml"), 'like: "1"\nlength_cm: 4\npasses: 1\n');
  writeFileSync(join(folder, "study.yaml"), `title: A small study
resolution: coarse
cameras: [${folder}/small.yaml]
trajectories: [${folder}/short.yaml]
commands: {nothing: ["/bin/false"]}
methods: [paper, nothing]
axes: {frames: [12, 10]}
`);
  const run = spawnSync(program, ["run", join(folder, "study.yaml"), "--out", join(folder, "out")], {stdio: ["ignore", "ignore", "inherit"]});
  assert.equal(run.status, 3, "expected the exit code of a study in which cells failed");
  return {folder, remove: () => rmSync(folder, {recursive: true, force: true})};
}

const kPlots = [
  {kind: "lines", title: "Curves", x: {label: "noise"}, y: {label: "error (mm)"},
   series: [{name: "one", x: [0, 1, 2, 3], y: [1, 2, null, 4], low: [0.5, 1, null, 3], high: [2, 3, null, 6]},
            {name: "two", x: [0, 3], y: [2, 1], low: null, high: null}],
   marks: [{x: 2.5, label: "breaks down"}]},
  {kind: "bars", title: "Bars", unit: "mm",
   bars: [{name: "a", value: 4, low: 3, high: 5}, {name: "b", value: 2, low: null, high: null},
          {name: "c", value: null, low: null, high: null}]},
];

/** The study's page with plots in it, as studies/data_plots.h writes them; returns the file. */
export function pageWithPlots(folder) {
  const figures = kPlots.map((plot) => `<figure class="plot"><script type="application/json" class="plot">${JSON.stringify(plot)}` +
    `</script><div class="table"><table><thead><tr><th></th></tr></thead><tbody><tr><td>1</td></tr></tbody></table></div></figure>`);
  const page = readFileSync(join(folder, "out", "report.html"), "utf8");
  const at = page.lastIndexOf('<section class="chapter"><h2>How to read this');
  const file = join(folder, "out", "with_plots.html");
  writeFileSync(file, page.slice(0, at) + `<section id="plots">${figures.join("")}</section>` + page.slice(at));
  return file;
}
