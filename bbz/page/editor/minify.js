// Writes scripts and styles of the playground again, without comments and with short names, and next to them the package that unpacks its module.
// Run by `cargo xtask site`: node minify.js SITE

import { readdirSync } from "node:fs";
import { join, resolve } from "node:path";
import { build } from "esbuild";

const site = resolve(process.argv[2]);
const settings = { outdir: site, minify: true, charset: "utf8", logLevel: "warning" };
// The bundle of the editor's packages is minified already, below their licenses.
const names = readdirSync(site).filter((name) => /\.(js|css)$/.test(name) && name !== "vendor.js");
await build({ ...settings, entryPoints: names.map((name) => join(site, name)), allowOverwrite: true, legalComments: "none" });
// Its license stands in a comment.
await build({ ...settings, entryPoints: ["unpack.ts"], bundle: true, format: "esm", legalComments: "inline" });
