// The page of a small study in a browser without a screen, opened from disk. RUGAE_PROGRAM names the program that makes it,
// CHROMIUM the browser, if it is not /usr/bin/chromium. RUGAE_STUDY, if given, names the folder of a study made before.

import assert from "node:assert/strict";
import {after, before, test} from "node:test";
import {pathToFileURL} from "node:url";
import {chromium} from "playwright-core";

import {middleOf, shareDifferent, show} from "./pixels.js";
import {makeStudy, pageWithPlots} from "./study.js";

const kBrowser = {
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  // As root; WebGL without a graphics card.
  args: ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
};

const kPatience_ms = 60_000;  // of a busy machine without a graphics card

let study, file, browser;

before(async () => {
  const {RUGAE_PROGRAM: program, RUGAE_STUDY: finished} = process.env;
  assert.ok(program || finished, "RUGAE_PROGRAM names no program");
  study = finished ? {folder: finished, remove() {}} : makeStudy(program);
  file = pageWithPlots(study.folder);
  browser = await chromium.launch(kBrowser);
});

after(async () => {
  await browser?.close();
  study?.remove();
});

/** Opens the page, gives it to `look`, and fails on whatever it told the console or asked of the network. */
async function visit(look, options = {}) {
  const context = await browser.newContext({viewport: {width: 1000, height: 700}, ...options});
  const page = await context.newPage();
  const complaints = [];
  page.on("console", (message) => {
    // Of the software renderer, when a test reads pixels.
    if (/GPU stall due to ReadPixels/.test(message.text())) return;
    if (["error", "warning", "assert"].includes(message.type())) complaints.push(`${message.type()}: ${message.text()}`);
  });
  page.on("pageerror", (error) => complaints.push(error.stack));
  page.on("request", (request) => {
    const url = request.url();
    if (!/^(data|blob):/.test(url) && url.split("#")[0] !== pathToFileURL(file).href) complaints.push(`asks for ${url}`);
  });
  page.setDefaultTimeout(kPatience_ms);
  await page.goto(pathToFileURL(file).href);
  await look(page);
  await page.waitForTimeout(200);
  await context.close();
  assert.deepEqual(complaints, []);
}

/** Opens the cell of a method by its row and returns its view, built. */
async function openCell(page, method) {
  await page.locator("tr.opens", {hasText: method}).first().locator("td").nth(3).click();
  const view = page.locator("details[open] .view").first();
  await show(view);
  await view.locator("canvas").waitFor();
  await page.waitForFunction(() => document.querySelector("details[open] .view-frame img")?.naturalWidth > 0);
  return view;
}

const shownFrame = (view) => view.locator(".view-frame img").getAttribute("src");
const shownWhere = (view) => view.locator(".view-facts b").innerText();

test("a click on a row opens its cell and shows its frames", () => visit(async (page) => {
  assert.equal(await page.locator("details[open]").count(), 0);
  assert.equal(await page.locator("canvas").count(), 0, "nothing is built before it is looked at");
  const view = await openCell(page, "paper");
  const pictures = await view.locator("img").evaluateAll((images) => images.map((image) => image.naturalWidth));
  assert.ok(pictures.length >= 5 && pictures.every((width) => width > 0), `pictures of width ${pictures}`);
}));

test("wall, map and paths are there, each for itself", () => visit(async (page) => {
  const view = await openCell(page, "paper");
  const host = view.locator(".view-host");
  let before = await middleOf(page, host);
  for (const [name, least] of [["Paths", 0.0004], ["Map", 0.01], ["Wall", 0.1]]) {
    const button = view.getByRole("button", {name, exact: true});
    await button.click();
    assert.equal(await button.getAttribute("aria-pressed"), "false");
    const without = await middleOf(page, host);
    const share = shareDifferent(before, without);
    assert.ok(share >= least, `${name}: ${share} of the picture, expected ${least} at least`);
    before = without;
  }
}));

test("the map has the colours of its errors", () => visit(async (page) => {
  const view = await openCell(page, "paper");
  const host = view.locator(".view-host");
  await view.getByRole("button", {name: "Wall", exact: true}).click();
  const shown = await middleOf(page, host);
  await view.getByRole("button", {name: "Map", exact: true}).click();
  const hidden = await middleOf(page, host);
  let map = 0, teal = 0, red = 0;  // pixels of the map alone: paths and capsule are in both
  for (let i = 0; i < shown.length; i += 4) {
    if (Math.abs(shown[i] - hidden[i]) + Math.abs(shown[i + 1] - hidden[i + 1]) < 16) continue;
    ++map;
    if (shown[i + 1] > shown[i] + 20) ++teal;
    if (shown[i] > shown[i + 1] + 60) ++red;
  }
  assert.ok(teal > 0.02 * map && red > 0.02 * map, `of ${map} pixels ${teal} show small errors, ${red} large ones`);
}));

test("the slider moves the cursor: the frame, its text and the capsule", () => visit(async (page) => {
  const view = await openCell(page, "paper");
  const slider = view.locator("input[type=range]");
  const frames = new Set(), places = new Set();
  await slider.focus();
  await page.keyboard.press("Home");
  const first = await middleOf(page, view.locator(".view-host"));
  for (let k = 0; k < 12; ++k) {
    frames.add(await shownFrame(view));
    const [capsule, truth] = await view.evaluate((place, k) =>
      [place.view.capsule.truth.position.toArray(), place.view.data.stops[k].pose.slice(0, 3)], k);
    assert.deepEqual(capsule, truth);
    places.add(await shownWhere(view));
    await page.keyboard.press("ArrowRight");
  }
  assert.equal(frames.size, 12);
  assert.equal(places.size, 12);
  assert.match(await shownWhere(view), /^frame 11 /);
  assert.ok(shareDifferent(first, await middleOf(page, view.locator(".view-host"))) > 0.0003, "the picture is the same");
}));

test("arrow keys and a click on the path move the cursor", () => visit(async (page) => {
  const view = await openCell(page, "paper");
  await view.focus();
  await page.keyboard.press("End");
  assert.match(await shownWhere(view), /^frame 11 /);
  await page.keyboard.press("ArrowLeft");
  assert.match(await shownWhere(view), /^frame 10 /);
  const host = view.locator(".view-host");
  await show(host);
  const at = await view.evaluate((place) => place.view.stage.onScreen(place.view.path.truth_mm[0]));
  const box = await host.boundingBox();
  await page.mouse.click(box.x + at[0], box.y + at[1]);
  assert.match(await shownWhere(view), /^frame 0 /);
}));

test("a drag turns the organ and does not move the cursor", () => visit(async (page) => {
  const view = await openCell(page, "paper");
  const host = view.locator(".view-host"), before = await middleOf(page, host), where = await shownWhere(view);
  // It begins and ends close to the last place of the path, where a click would move the cursor.
  const at = await view.evaluate((place) => place.view.stage.onScreen(place.view.path.truth_mm.at(-1)));
  const box = await host.boundingBox();
  await page.mouse.move(box.x + at[0], box.y + at[1]);
  await page.mouse.down();
  await page.mouse.move(box.x + at[0] + 26, box.y + at[1] + 8, {steps: 4});
  await page.mouse.up();
  assert.ok(shareDifferent(before, await middleOf(page, host)) > 0.02, "the picture is the same");
  assert.equal(await shownWhere(view), where);
}));

test("one can look from where the capsule was", () => visit(async (page) => {
  const view = await openCell(page, "paper");
  const host = view.locator(".view-host"), outside = await middleOf(page, host);
  await view.getByRole("button", {name: "From the capsule"}).click();
  const inside = await middleOf(page, host);
  assert.ok(shareDifferent(outside, inside) > 0.3, "the picture is the same");
  // Wall all around: the page's own ground, which shows beside the organ, is nowhere.
  await view.getByRole("button", {name: "Map", exact: true}).click();
  await view.getByRole("button", {name: "Wall", exact: true}).click();
  const empty = await middleOf(page, host);
  assert.ok(shareDifferent(inside, empty) > 0.95, `${shareDifferent(inside, empty)} of the picture is wall`);
}));

test("a cell that failed still shows the truth", () => visit(async (page) => {
  const view = await openCell(page, "nothing");
  assert.equal(await view.getByRole("button", {name: "Map", exact: true}).count(), 0);
  const host = view.locator(".view-host"), before = await middleOf(page, host);
  await view.getByRole("button", {name: "Wall", exact: true}).click();
  const bare = await middleOf(page, host);
  assert.ok(shareDifferent(before, bare) > 0.1, "no wall");
  await view.getByRole("button", {name: "Paths", exact: true}).click();
  assert.ok(shareDifferent(bare, await middleOf(page, host)) > 0.0003, "no true path");
  assert.match(await view.locator(".view-facts span").innerText(), /no estimate/);
}));

test("a click on a head sorts the table, and another turns it round", () => visit(async (page) => {
  const table = page.locator("table.sortable").first();
  const column = await table.locator("th").evaluateAll((heads) => heads.findIndex((head) => /^ATE/.test(head.textContent)));
  assert.ok(column >= 0, "no column of path errors");
  const texts = () => table.locator("tbody tr").evaluateAll((rows, k) => rows.map((row) => row.cells[k].textContent), column);
  const head = table.locator("th").nth(column);
  await head.getByRole("button").click();
  assert.equal(await head.getAttribute("aria-sort"), "ascending");
  const up = await texts();
  assert.equal(up.length, 4);
  assert.ok(Number(up[0]) <= Number(up[1]), `${up}`);
  assert.deepEqual(up.slice(2), ["\u2013", "\u2013"]);
  await head.getByRole("button").click();
  assert.equal(await head.getAttribute("aria-sort"), "descending");
  assert.deepEqual(await texts(), [up[1], up[0], "\u2013", "\u2013"]);
  assert.notEqual(up[0], up[1], "the study's two errors are the same, so that the order shows nothing");
  await table.locator("th").first().getByRole("button").click();
  assert.equal(await table.locator("th[aria-sort]").count(), 1);
}));

test("plots are drawn, and their tables folded away", () => visit(async (page) => {
  const [lines, bars] = [page.locator("#plots figure").nth(0), page.locator("#plots figure").nth(1)];
  await lines.locator("svg").first().waitFor();
  const of = (figure, label) => figure.locator(`g[aria-label="${label}"] > *`);
  assert.equal(await of(lines, "line").count(), 2, "curves");
  assert.equal(await of(lines, "dot").count(), 5, "points that are known");
  assert.ok(await of(lines, "area").count() >= 1, "a band");
  assert.equal(await lines.getByText("breaks down").count(), 1);
  // A gap where a value is null: the curve starts anew.
  assert.equal((await of(lines, "line").first().getAttribute("d")).match(/M/g).length, 2);
  const widths = await of(bars, "bar").evaluateAll((all) => all.map((bar) => bar.getBBox().width));
  assert.equal(widths.length, 2);
  assert.ok(Math.abs(widths[0] / widths[1] - 2) < 0.1, `bars of ${widths} for 4 and 2`);
  assert.equal(await bars.getByText("not measured").count(), 1);
  assert.equal(await page.locator("#plots table:visible").count(), 0);
  assert.equal(await page.locator("figure.plot:not(:has(svg))").count(), 0);
}));

for (const [name, options] of [["dark", {colorScheme: "dark"}],
                               ["narrow", {viewport: {width: 390, height: 800}, hasTouch: true, isMobile: true}]])
  test(`it holds on a ${name} screen`, () => visit(async (page) => {
    const view = await openCell(page, "paper");
    const [has, needs] = await page.evaluate(() => [document.documentElement.clientWidth, document.documentElement.scrollWidth]);
    assert.ok(needs <= has, `${needs} px of page on ${has} px of screen`);
    const host = view.locator(".view-host"), before = await middleOf(page, host);
    await view.getByRole("button", {name: "Wall", exact: true}).click();
    assert.ok(shareDifferent(before, await middleOf(page, host)) > 0.1);
  }, options));

test("light turns dark while the page is open", () => visit(async (page) => {
  const view = await openCell(page, "paper");
  const path = () => view.evaluate((place) => place.view.capsule.trueMaterial.color.getHexString());
  const light = await path();
  await page.emulateMedia({colorScheme: "dark"});
  await page.waitForFunction((before) =>
    document.querySelector("details[open] .view").view.capsule.trueMaterial.color.getHexString() !== before, light);
  assert.equal(await path(), "f2e8e2", "the page's ink on dark");
}));
