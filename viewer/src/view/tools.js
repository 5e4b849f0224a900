// The small things over the picture: what is shown, from where, and what the colours mean.

import {element} from "../dom.js";

/** A button that stays down. `onChange(on)`. */
export function toggle(name, on, onChange) {
  const button = element("button", {type: "button", class: "pill", "aria-pressed": String(on), onclick: () => {
    const now = button.getAttribute("aria-pressed") !== "true";
    button.setAttribute("aria-pressed", String(now));
    onChange(now);
  }}, name);
  return button;
}

const css = ([r, g, b]) => `rgb(${[r, g, b].map((v) => Math.round(255 * v)).join(" ")})`;

/** The bar of errors: 0 to `worst_mm` and more. */
export function colourBar(title, colours, worst_mm) {
  return element("div", {class: "colour-bar"}, element("span", {}, title),
                 element("i", {style: `background:linear-gradient(to right, ${colours.map(css).join(", ")})`}),
                 element("span", {class: "ends"}, element("span", {}, "0"), element("span", {}, `${Number(worst_mm.toPrecision(4))} mm +`)));
}
