// Writes scripts and styles of the playground again, without comments and with short names. Run by `cargo xtask site`: node minify.js SITE

import { readdirSync } from "node:fs";
import { join, resolve } from "node:path";
import { build } from "esbuild";

const site = resolve(process.argv[2]);
// The bundle of packages is minified already, below their licenses.
const names = readdirSync(site).filter((name) => /\.(js|css)$/.test(name) && name !== "vendor.js");
await build({
    entryPoints: names.map((name) => join(site, name)), outdir: site, allowOverwrite: true, minify: true, legalComments: "none",
    // A page that exports itself holds the files as they are.
    charset: "utf8", logLevel: "warning",
});
