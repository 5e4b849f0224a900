// Bundles src/ with its libraries and styles into dist/viewer.js, one script that stands inside a page.

import {build} from "esbuild";
import {mkdir, rename, writeFile} from "node:fs/promises";
import {fileURLToPath} from "node:url";

const here = new URL(".", import.meta.url);
const bundled = await build({
  absWorkingDir: fileURLToPath(here),
  entryPoints: ["src/main.js"],
  bundle: true,
  minify: true,
  write: false,
  format: "iife",
  charset: "ascii",
  legalComments: "eof",
  target: ["chrome110", "firefox110", "safari16"],
  loader: {".css": "text"},
});
const script = bundled.outputFiles[0].text;
// Either would end the script early, or hide its end, in the page that holds it.
for (const forbidden of ["</script", "<!--"])
  if (script.toLowerCase().includes(forbidden)) throw new Error(`viewer: the bundle contains ${forbidden}`);

await mkdir(new URL("dist/", here), {recursive: true});
await writeFile(new URL("dist/viewer.js.new", here), script);
await rename(new URL("dist/viewer.js.new", here), new URL("dist/viewer.js", here));
console.log(`viewer: dist/viewer.js, ${Math.round(script.length / 1024)} kB`);
