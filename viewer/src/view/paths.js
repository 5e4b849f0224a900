// The true path and the estimated one, as lines of some width.

import {Color, Group, SRGBColorSpace} from "three";
import {LineMaterial} from "three/addons/lines/LineMaterial.js";
import {LineSegments2} from "three/addons/lines/LineSegments2.js";
import {LineSegmentsGeometry} from "three/addons/lines/LineSegmentsGeometry.js";

const known = (point) => point.every(Number.isFinite);

/** Pieces between neighbours that are both known: a lost frame leaves a gap. */
function pieces(points) {
  const ends = [];
  for (let i = 1; i < points.length; ++i) if (known(points[i - 1]) && known(points[i])) ends.push(i - 1, i);
  return ends;
}

function line(points, ends, material) {
  const geometry = new LineSegmentsGeometry();
  geometry.setPositions(ends.flatMap((i) => points[i]));
  const made = new LineSegments2(geometry, material);
  made.frustumCulled = false;
  return made;
}

/** The colour of an error, from the page's list of sRGB colours. */
export function errorColour(colours, share) {
  const at = Math.round(Math.min(Math.max(share, 0), 1) * (colours.length - 1));
  return new Color().setRGB(...colours[at], SRGBColorSpace);
}

/** `path` holds lists of truth_mm, estimate_mm and error_mm. `tint(css)` colours the true path. */
export function pathsOf(path, errorColours) {
  const group = new Group();
  // Where both lie together, the thin true path is drawn over the wide estimate.
  const over = {polygonOffset: true, polygonOffsetFactor: 0, polygonOffsetUnits: -30};
  const truth = line(path.truth_mm, pieces(path.truth_mm), new LineMaterial({linewidth: 1.8, ...over}));
  group.add(truth);
  const ends = pieces(path.estimate_mm);
  if (ends.length) {
    const estimate = line(path.estimate_mm, ends, new LineMaterial({linewidth: 5, vertexColors: true}));
    estimate.geometry.setColors(ends.flatMap((i) => errorColour(errorColours, path.error_mm[i] / path.worst_mm).toArray()));
    group.add(estimate);
  }
  group.tint = (css) => truth.material.color.set(css);
  return group;
}
