// The frame at the cursor, large, and its labels.

import {element} from "../dom.js";

const kNames = {
  depth: "Depth", normals: "Normals", flow: "Flow", masks: "Masks", backward_flow: "Flow back", range: "Range",
  triangles: "Triangles", shading_normals: "Shading normals", albedo: "Albedo", diffuse: "Diffuse", specular: "Specular",
  indirect: "Indirect", regions: "Regions", instances: "Instances",
};

function picture(name, alt) {
  return element("img", {class: "zoom", alt, "data-name": name});
}

export class Pictures {
  /** `labels` lists {name, key}; the element to show is `root`. */
  constructor(labels) {
    this.frame = picture("frame", "the frame at the cursor");
    this.labels = labels.map(({name, key}) => ({name, image: picture(name, kNames[name] ?? name), key}));
    const figures = this.labels.map(({name, image, key}) =>
      element("figure", {title: key}, image, element("figcaption", {}, element("b", {}, kNames[name] ?? name), ` ${key}`)));
    this.root = element("div", {class: "view-pictures"},
                        element("figure", {class: "view-frame"}, this.frame), element("div", {class: "view-labels"}, ...figures));
  }

  /** Shows the pictures of a stop, each gone where there is none (flow of the last frame). `then` gets the frame, loaded. */
  show(pictures, then) {
    this.frame.src = pictures.frame;
    for (const {name, image} of this.labels) {
      image.classList.toggle("absent", !pictures[name]);
      if (pictures[name]) image.src = pictures[name];
      else image.removeAttribute("src");
    }
    const wanted = pictures.frame;
    this.frame.decode().then(() => {
      if (this.frame.getAttribute("src") === wanted) then(this.frame);
    }).catch(() => {});  // another frame took its place before it was decoded
  }
}
