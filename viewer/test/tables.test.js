// The order of a table's rows.

import assert from "node:assert/strict";
import {test} from "node:test";

import {fragment} from "../src/cells.js";
import {numberIn, sortedOrder, valueText} from "../src/tables.js";

const sorted = (texts, descending = false) => sortedOrder(texts, descending).map((i) => texts[i]);

test("a text begins with a number, or does not", () => {
  for (const [text, number] of [["12.3", 12.3], [" 40 % ", 40], ["\u22121.5", -1.5], ["\u00d7 0.5", 0.5], ["1e-3", 1e-3], [".5", 0.5],
                                ["3 mm", 3], ["0", 0], ["misumi", null], ["", null], ["\u2013", null], ["2001-01-02", null]])
    assert.equal(numberIn(text), number, text);
});

test("numbers sort as numbers, with their units", () => {
  assert.deepEqual(sorted(["10", "9.5", "100 %", "-1"]), ["-1", "9.5", "10", "100 %"]);
  assert.deepEqual(sorted(["10", "9.5", "100 %", "-1"], true), ["100 %", "10", "9.5", "-1"]);
  assert.deepEqual(sorted(["0.3", "0.25", "-1", "-2"]), ["-2", "-1", "0.25", "0.3"]);
});

test("dashes come last in both directions, in their old order", () => {
  assert.deepEqual(sortedOrder(["\u2013", "2", "", "1"], false), [3, 1, 0, 2]);
  assert.deepEqual(sortedOrder(["\u2013", "2", "", "1"], true), [1, 3, 0, 2]);
});

test("one text makes the column text; numbers inside texts still count", () => {
  assert.deepEqual(sorted(["cam10", "cam9", "7"]), ["7", "cam9", "cam10"]);
});

test("equals keep their order", () => {
  assert.deepEqual(sortedOrder(["1.0", "1", "0"], false), [2, 0, 1]);
  assert.deepEqual(sortedOrder(["1.0", "1", "0"], true), [0, 1, 2]);
});

test("small print below a value does not sort", () => {
  const cell = (...lines) => ({
    childNodes: lines.flatMap((line, i) => (i > 0 ? [{nodeName: "BR", textContent: ""}] : []).concat({nodeName: "#text", textContent: line})),
    textContent: lines.join(""),
  });
  assert.equal(valueText(cell("850", "1 failed")), "850");
  assert.equal(valueText(cell("\u2013", "2 failed")), "\u2013");
  assert.equal(valueText(cell("paper", "wetness 0.5")), "paperwetness 0.5");
  assert.equal(valueText(undefined), "");
});

test("a link's name is decoded, and one that cannot be stands for itself", () => {
  assert.equal(fragment("#noise-50%25_1"), "noise-50%_1");
  assert.equal(fragment("#noise-50%_1"), "noise-50%_1");
});
