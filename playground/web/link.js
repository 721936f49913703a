// Scripts in the address of the page, compressed and in the letters of addresses.
//
// Anybody can write an address, and compressed text may be a thousandth of its length. The text is therefore read piece by piece, and
// reading ends at the limit: what lies behind it never gets into memory.

// Bytes of the longest script that the compiler reads.
const SCRIPT_BYTES_MAX = 1 << 20;

// Bytes of all scripts of an address together.
const LINK_BYTES_MAX = 4 << 20;

/**
 * @import { Texts } from "./page"
 */

// An address with a script, or with scripts, beyond the limits.
export class LinkTooLong extends Error {
    /** @param {string} path */
    constructor(path) {
        super(path);
        this.path = path;
    }
}

/** @param {string} text */
export async function pack(text) {
    const compressed = new Blob([text]).stream().pipeThrough(new CompressionStream("deflate-raw"));
    const bytes = new Uint8Array(await new Response(compressed).arrayBuffer());
    const letters = Array.from(bytes, (byte) => String.fromCharCode(byte)).join("");
    return btoa(letters).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

/**
 * @param {string[]} scripts
 * @returns {Promise<Texts>}
 */
export async function unpack(scripts) {
    /** @type {Texts} */
    const unpacked = {};
    let left = LINK_BYTES_MAX;
    // One after the other, so that all of them share the limit.
    for (const one of scripts) {
        const [name, packed] = one.split("=");
        const path = decodeURIComponent(name);
        const letters = atob(packed.replaceAll("-", "+").replaceAll("_", "/"));
        const bytes = Uint8Array.from(letters, (letter) => letter.charCodeAt(0));
        const text = await inflate(bytes, Math.min(left, SCRIPT_BYTES_MAX), path);
        left -= text.length;
        unpacked[path] = new TextDecoder().decode(text);
    }
    return unpacked;
}

// Returns the bytes that were compressed, at most `most`.
/**
 * @param {Uint8Array<ArrayBuffer>} bytes
 * @param {number} most
 * @param {string} path
 */
async function inflate(bytes, most, path) {
    const reader = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw")).getReader();
    const pieces = [];
    let length = 0;
    for (;;) {
        const { done, value } = await reader.read();
        if (done) {
            return new Uint8Array(await new Blob(pieces).arrayBuffer());
        }
        length += value.length;
        if (length > most) {
            // An error of the stream is of no interest any more.
            reader.cancel().catch(() => {});
            throw new LinkTooLong(path);
        }
        pieces.push(value);
    }
}
