// Bundles vendor.ts with the packages that it names into one file, below their licenses. Run by `cargo xtask vendor`: node build.js FILE

import { readFileSync, writeFileSync } from "node:fs";
import { build } from "esbuild";

const { outputFiles: [{ text }], metafile } = await build({
    entryPoints: ["vendor.ts"], bundle: true, format: "esm", minify: true, legalComments: "none", metafile: true, write: false,
});

// node_modules/NAME/…, node_modules/@SCOPE/NAME/…
const folders = Object.keys(metafile.inputs).map((path) => path.match(/^node_modules\/(@[^/]+\/)?[^/]+/)?.[0]);
const packages = new Map();
for (const folder of new Set(folders.filter(Boolean))) {
    const { name, version } = JSON.parse(readFileSync(`${folder}/package.json`, "utf8"));
    const license = readFileSync(`${folder}/LICENSE`, "utf8").trim();
    packages.set(license, [...(packages.get(license) ?? []), `${name} ${version}`].sort());
}
const parts = [...packages].map(([license, names]) => `${names.join(", ")}:\n\n${license}`).sort();
writeFileSync(process.argv[2], `/*\nMade by \`cargo xtask vendor\` from these packages.\n\n${parts.join("\n\n")}\n*/\n${text}`);
