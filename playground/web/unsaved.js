// Texts that were typed and not saved, in the browser's storage, as the server of `bbz sim --view` keeps them in files (bbz/src/sim/unsaved.rs):
// an entry has one text of one page, and a page writes only its own entries.

/**
 * @import { UnsavedText } from "./events"
 */

// The beginning of all entries.
const PREFIX = "bittybuzz-unsaved";

export class UnsavedTexts {
    constructor() {
        // Entries of this page end with it.
        this.page = crypto.getRandomValues(new Uint32Array(2)).join("-");
    }

    // Returns what earlier pages left of a file, oldest first. A text that the file has is forgotten.
    /**
     * @param {string} file its path
     * @param {string} name its name in the scenario
     * @param {string} saved its text
     */
    offers(file, name, saved) {
        /** @type {UnsavedText[]} */
        const offers = [];
        for (const id of this.others(file)) {
            const { seconds, over, text } = JSON.parse(localStorage.getItem(id) ?? "{}");
            if (text === saved) {
                localStorage.removeItem(id);
            } else if (typeof text === "string") {
                offers.push({ id, name, file, seconds, changed: over !== hash(saved), text });
            }
        }
        return offers.sort((one, other) => one.seconds - other.seconds);
    }

    // Keeps a text in the place of the one before; `null`: nothing is unsaved.
    /**
     * @param {string} file
     * @param {string} saved
     * @param {string | null} text
     */
    keep(file, saved, text) {
        const own = `${PREFIX}:${file}:${this.page}`;
        if (text === null) {
            localStorage.removeItem(own);
            return;
        }
        localStorage.setItem(own, JSON.stringify({ seconds: Math.floor(Date.now() / 1000), over: hash(saved), text }));
        const same = this.others(file).filter((id) => JSON.parse(localStorage.getItem(id) ?? "{}").text === text);
        same.forEach((id) => localStorage.removeItem(id));
    }

    /** @param {string} id */
    discard(id) {
        localStorage.removeItem(id);
    }

    // Returns the names of other pages' entries.
    /** @param {string} file */
    others(file) {
        const prefix = `${PREFIX}:${file}:`;
        return Object.keys(localStorage).filter((id) => id.startsWith(prefix) && id !== prefix + this.page);
    }
}

// FNV-1a: enough to see that an example has another text than before.
/** @param {string} text */
function hash(text) {
    let sum = 0x811c9dc5;
    for (let at = 0; at < text.length; at++) {
        sum = Math.imul(sum ^ text.charCodeAt(at), 0x01000193);
    }
    return (sum >>> 0).toString(16);
}
