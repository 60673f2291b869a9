// Builds the page's parts into runtime/omniroll/viewer/assets, or into the folder that is given.
// The first line of viewer.js holds a checksum of all that it was built from; a test compares it.

import { createHash } from "node:crypto";
import { mkdirSync, readFileSync, readdirSync, writeFileSync, copyFileSync } from "node:fs";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const here = dirname(fileURLToPath(import.meta.url));
const target = process.argv[2] ? resolve(process.argv[2]) : join(here, "../runtime/omniroll/viewer/assets");
const sources = [
  "package-lock.json",
  "build.mjs",
  ...readdirSync(join(here, "src"))
    .sort()
    .map((name) => `src/${name}`),
];

const checksum = createHash("sha256");
for (const name of sources) checksum.update(readFileSync(join(here, name)));

mkdirSync(target, { recursive: true });
const common = { bundle: true, minify: true, target: "es2022", legalComments: "none", absWorkingDir: here };
await build({
  ...common,
  entryPoints: ["src/main.js"],
  format: "iife",
  outfile: join(target, "viewer.js"),
  banner: { js: `// built from viewer/, sha256 ${checksum.digest("hex")}` },
});
await build({ ...common, entryPoints: ["src/start.js"], format: "iife", outfile: join(target, "start.js") });
await build({ ...common, entryPoints: ["src/viewer.css"], outfile: join(target, "viewer.css") });
copyFileSync(join(here, "src/page.html"), join(target, "page.html"));

const licence = (name) => {
  const { version } = JSON.parse(readFileSync(join(here, "node_modules", name, "package.json"), "utf8"));
  return `${name} ${version}\n\n${readFileSync(join(here, "node_modules", name, "LICENSE"), "utf8").trim()}\n`;
};
writeFileSync(join(target, "LICENCES.txt"), ["three", "uplot"].map(licence).join("\n"));
