// Writes the playground's own scripts again as one file, without comments and with short names, and the style likewise. The package that
// unpacks the module comes next to it. Run by `cargo xtask site`: node minify.js SITE

import { readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { join, resolve } from "node:path";
import { build } from "esbuild";
import { minify } from "terser";

const site = resolve(process.argv[2]);
const settings = { outdir: site, charset: "utf8", logLevel: "warning", format: "esm", bundle: true };
// Its license stands in a comment.
await build({ ...settings, entryPoints: ["unpack.ts"], minify: true, legalComments: "inline" });
// The worker imports nothing.
const entries = ["main.js", "worker.js", "style.css"];
const others = ["vendor.js", "unpack.js"];
const external = others.map((name) => `./${name}`);
const entryPoints = entries.map((name) => join(site, name));
await build({ ...settings, entryPoints, minify: true, external, allowOverwrite: true, legalComments: "none" });
// Terser makes 3 % less of what esbuild leaves. The bundle of the editor's packages begins with their licenses.
for (const name of ["main.js", "vendor.js"]) {
    const path = join(site, name);
    const { code } = await minify(readFileSync(path, "utf8"), { module: true, compress: { passes: 3 }, format: { comments: /Made by/ } });
    writeFileSync(path, code);
}
const parts = readdirSync(site).filter((name) => name.endsWith(".js") && ![...entries, ...others].includes(name));
parts.forEach((name) => rmSync(join(site, name)));
