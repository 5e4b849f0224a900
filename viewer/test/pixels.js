// What a part of the page looks like, as numbers.

/** Scrolls there at once. */
export const show = (locator) => locator.evaluate((element) => element.scrollIntoView({block: "center", behavior: "instant"}));

/** RGBA of the middle of an element, as it is on the screen, without what lies over its edges. */
export async function middleOf(page, locator) {
  await show(locator);
  await page.waitForTimeout(300);  // what was asked for is drawn in the frames that follow
  const box = await locator.boundingBox();
  const clip = {x: box.x + 0.1 * box.width, y: box.y + 0.2 * box.height, width: 0.8 * box.width, height: 0.55 * box.height};
  const png = await page.screenshot({clip});
  const numbers = await page.evaluate(async (text) => {
    const picture = await createImageBitmap(await (await fetch(`data:image/png;base64,${text}`)).blob());
    const context = new OffscreenCanvas(picture.width, picture.height).getContext("2d");
    context.drawImage(picture, 0, 0);
    return btoa(Array.from(context.getImageData(0, 0, picture.width, picture.height).data, (b) => String.fromCharCode(b)).join(""));
  }, png.toString("base64"));
  return Buffer.from(numbers, "base64");
}

/** Share of pixels whose channels differ by more than `least` in sum. */
export function shareDifferent(a, b, least = 24) {
  if (a.length !== b.length) throw new Error(`pictures of ${a.length} and ${b.length} bytes`);
  let count = 0;
  for (let i = 0; i < a.length; i += 4)
    if (Math.abs(a[i] - b[i]) + Math.abs(a[i + 1] - b[i + 1]) + Math.abs(a[i + 2] - b[i + 2]) > least) ++count;
  return count / (a.length / 4);
}
