// Tables that sort by the column whose head is clicked.

import {element} from "./dom.js";

const kDashes = new Set(["", "-", "\u2013", "\u2014"]);
const kNumber = /^[\u00d7x<>]?\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)(?![\w.]*-|[\d.])/i;
const collator = new Intl.Collator("en", {numeric: true, sensitivity: "base"});

/** The number a cell's text begins with ("12.3 %", "+4", "\u22121.5", "\u00d7 0.5"); null where it does not. */
export function numberIn(text) {
  const found = kNumber.exec(text.trim().replace(/\u2212/g, "-"));
  return found ? Number(found[1]) : null;
}

/**
 * The order in which rows with these texts stand, as indices: numbers as numbers where every text begins with one, else as
 * text; dashes (nothing measured) last in both directions; equals keep their order.
 */
export function sortedOrder(texts, descending) {
  const known = texts.map((text) => !kDashes.has(text.trim()));
  const numbers = texts.map(numberIn);
  const numeric = texts.every((text, i) => !known[i] || numbers[i] !== null);
  const compare = (a, b) => (numeric ? numbers[a] - numbers[b] : collator.compare(texts[a], texts[b]));
  return texts.map((_, i) => i).sort((a, b) => {
    if (known[a] !== known[b]) return known[a] ? -1 : 1;
    if (!known[a]) return a - b;
    return (descending ? -compare(a, b) : compare(a, b)) || a - b;
  });
}

/** What a cell is sorted by: its first line where that is a number or a dash (small print stands below), else all of it. */
export function valueText(cell) {
  let first = "";
  for (const node of cell?.childNodes ?? []) {
    if (node.nodeName === "BR") break;
    first += node.textContent;
  }
  const measured = numberIn(first) !== null || kDashes.has(first.trim());
  return measured ? first : cell?.textContent ?? "";
}

function sortBy(table, column, descending) {
  const body = table.tBodies[0];
  const rows = [...body.rows];
  const order = sortedOrder(rows.map((row) => valueText(row.cells[column])), descending);
  body.append(...order.map((i) => rows[i]));
}

/** A button in every head that has a name; aria-sort tells the direction. */
export function makeSortable(table) {
  const heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => {
    if (!head.textContent.trim()) return;
    const button = element("button", {
      type: "button",
      class: "sort",
      title: "Sort by this column",
      onclick: () => {
        const descending = head.getAttribute("aria-sort") === "ascending";
        heads.forEach((other) => other.removeAttribute("aria-sort"));
        head.setAttribute("aria-sort", descending ? "descending" : "ascending");
        sortBy(table, column, descending);
      },
    });
    button.append(...head.childNodes);
    head.append(button);
  });
}
