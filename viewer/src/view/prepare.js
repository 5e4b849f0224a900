// Builds each view when it first comes near the screen: that of a closed cell when it is opened.

import {CellView} from "./cell_view.js";

const json = (script) => JSON.parse(script.textContent);

function build(place) {
  const data = json(place.querySelector("script.view-data"));
  const walls = [...document.querySelectorAll("script.wall-data")];
  // The id is looked for in the text, so that other walls need not be parsed.
  const wall = walls.find((script) => script.textContent.includes(`"${data.wall.id}"`));
  if (!wall) throw new Error(`view '${data.title}': the page has no wall '${data.wall.id}'`);
  new CellView(place, data, json(wall));
}

export function prepareViews(root) {
  const near = new IntersectionObserver((entries) => {
    for (const entry of entries) {
      if (!entry.isIntersecting) continue;
      near.unobserve(entry.target);
      build(entry.target);
    }
  }, {rootMargin: "300px"});
  root.querySelectorAll(".view").forEach((place) => near.observe(place));
}
