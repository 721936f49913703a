// Prints the page with all examples as a single file. Usage: node offline.mjs SITE
//
// The page exports itself in the same way in a browser (web/export.js), where files come from a server.
import { readFile } from "node:fs/promises";
import { resolve } from "node:path";
import { pathToFileURL } from "node:url";

// No file stands in the page itself.
globalThis.document = { getElementById: () => null };
globalThis.fetch = async (address) => new Response(await readFile(address));

const { exportPage } = await import(pathToFileURL(resolve(process.argv[2], "export.js")));
process.stdout.write(await exportPage(null, {}));
