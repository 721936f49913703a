// Prints the page with all examples as a single file. Usage: node offline.mjs SITE
//
// The page exports itself in the same way in a browser, where files come from a server.
import { readFile } from "node:fs/promises";
import { basename, join } from "node:path";
import { exportPage } from "./web/export.js";

// No file stands in the page itself.
globalThis.document = { getElementById: () => null };
globalThis.fetch = async (address) => new Response(await readFile(join(process.argv[2], basename(address.pathname))));

process.stdout.write(await exportPage(null, {}));
