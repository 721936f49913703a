// Writes the playground's own scripts again as one file, without comments and with short names, and the style likewise. The package that
// unpacks the module comes next to it. Run by `cargo xtask site`: node minify.js SITE

import { readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { join, resolve } from "node:path";
import { build } from "esbuild";
import { minify } from "terser";

const site = resolve(process.argv[2]);
const settings = { outdir: site, minify: true, charset: "utf8", logLevel: "warning" };
const bundle = { ...settings, format: "esm", bundle: true };
const own = { allowOverwrite: true, legalComments: "none" };
const paths = (/** @type {string[]} */ names) => names.map((name) => join(site, name));
// Its license stands in a comment.
await build({ ...bundle, entryPoints: ["unpack.ts"], legalComments: "inline" });
const others = ["vendor.js", "unpack.js"];
await build({ ...bundle, ...own, entryPoints: paths(["main.js", "style.css"]), external: others.map((name) => `./${name}`) });
// No module, and it imports nothing.
await build({ ...settings, ...own, entryPoints: paths(["worker.js"]) });
// Terser makes 3 % less of what esbuild leaves. The bundle of the editor's packages begins with their licenses.
for (const name of ["main.js", "vendor.js"]) {
    const path = join(site, name);
    const { code } = await minify(readFileSync(path, "utf8"), { module: true, compress: { passes: 3 }, format: { comments: /Made by/ } });
    writeFileSync(path, code);
}
const kept = ["main.js", "worker.js", ...others];
const parts = readdirSync(site).filter((name) => name.endsWith(".js") && !kept.includes(name));
paths(parts).forEach((path) => rmSync(path));
