// The page with one scenario or with all of them as a single file, which runs by a double click, without a network.
//
// Modules become data of an import map, since a page from a file may load no others; the rest stands in elements of the page.

const IMPORT = /from ?"\.\/([\w-]+\.js)"/g;

// The file of the WebAssembly module. It takes three quarters of what gzip makes of it.
export const MODULE = "playground.wasm.xz";

// Names by which modules of the file import each other.
const NAME = "playground/";

/**
 * @import { Texts } from "./page"
 */

// Returns a file that stands in this page, as an answer to `fetch`; `undefined` if it is elsewhere.
/** @param {string} name */
export function inlined(name) {
    const kept = document.getElementById(`file-${name}`);
    if (!kept) {
        return undefined;
    }
    const bytes = Uint8Array.from(atob(kept.textContent ?? ""), (letter) => letter.charCodeAt(0));
    return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip")));
}

// Returns the text of the file, with all scenarios if none is named.
/**
 * @param {string | null} scenario
 * @param {Texts} scripts
 */
export async function exportPage(scenario, scripts) {
    const examples = JSON.parse(await read("examples.json"));
    const scenarios = examples.scenarios.filter((/** @type {{ path: string }} */ { path }) => scenario === null || path === scenario);
    const own = { ...examples, scenarios, files: { ...examples.files, ...scripts } };
    /** @type {Record<string, string | ArrayBuffer>} */
    const files = {
        "worker.js": await read("worker.js"),
        [MODULE]: await (inlined(MODULE) ?? (await fetch(address(MODULE)))).arrayBuffer(),
        "examples.json": JSON.stringify(own),
        // An exported page exports itself.
        ...Object.fromEntries(await Promise.all(["index.html", "style.css"].map(async (name) => [name, await read(name)]))),
    };
    // In the order of their names, whichever came first, so that the file is always the same.
    const modules = [...await collect("main.js", new Map())].sort(([one], [other]) => (one < other ? -1 : 1));
    modules.forEach(([name, text]) => {
        files[name] = text;
    });
    const imports = Object.fromEntries(await Promise.all(modules.map(async ([name, text]) => {
        const renamed = text.replace(IMPORT, `from "${NAME}$1"`);
        return [NAME + name, `data:text/javascript;charset=utf-8;base64,${await base64(new Blob([renamed]))}`];
    })));
    const elements = await Promise.all(Object.entries(files).map(async ([name, content]) => {
        const compressed = new Response(new Blob([content]).stream().pipeThrough(new CompressionStream("gzip")));
        return `<script type="application/gzip" id="file-${name}">${await base64(await compressed.blob())}</script>`;
    }));
    return String(files["index.html"])
        .replace(/<link rel="stylesheet"[^>]*>/, () => `<style>\n${files["style.css"]}</style>`)
        .replace(/<script type="module"[^>]*><\/script>/, () => [
            `<script type="importmap">${JSON.stringify({ imports })}</script>`, ...elements,
            `<script type="module">import "${NAME}main.js";</script>`,
        ].join("\n"));
}

const address = (/** @type {string} */ name) => new URL(name, import.meta.url);

/** @param {string} name */
async function read(name) {
    return (inlined(name) ?? (await fetch(address(name)))).text();
}

// Adds a module and all that it imports.
/**
 * @param {string} name
 * @param {Map<string, string>} modules
 * @returns {Promise<Map<string, string>>}
 */
async function collect(name, modules) {
    if (!modules.has(name)) {
        // A module that is being read is not read twice.
        modules.set(name, "");
        const text = await read(name);
        modules.set(name, text);
        await Promise.all([...text.matchAll(IMPORT)].map(([, other]) => collect(other, modules)));
    }
    return modules;
}

// A call with all bytes of a large file as arguments would be refused.
const PIECE = 0x8000;

/** @param {Blob} blob */
async function base64(blob) {
    const bytes = new Uint8Array(await blob.arrayBuffer());
    let letters = "";
    for (let start = 0; start < bytes.length; start += PIECE) {
        letters += String.fromCharCode(...bytes.subarray(start, start + PIECE));
    }
    return btoa(letters);
}
