// Texts that are in no file: the session keeps them, and offers those that were typed earlier.

import { element, part, write } from "./element.js";
import { texts } from "./texts.js";

/**
 * @import { UnsavedText } from "./events"
 * @import { Editor, Script } from "./editor.js"
 */

// Milliseconds from a change until the session has the text, so that a crash loses little.
const KEEP = 500;

export class Unsaved {
    /** @param {Editor} editor */
    constructor(editor) {
        this.editor = editor;
        // Texts that were typed earlier, and the one of them that is to be shown.
        /** @type {UnsavedText[]} */
        this.offered = [];
        /** @type {UnsavedText | null} */
        this.restored = null;
        /** @type {number | undefined} */
        this.timer = undefined;
    }

    // A world begins. Returns true if there are texts that were typed earlier and not saved.
    /** @param {UnsavedText[]} offered */
    begin(offered) {
        this.offered = offered;
        this.show();
        for (const script of this.editor.scripts.values()) {
            script.unsaved = null;
        }
        this.keep();
        return this.offered.length > 0;
    }

    // Returns true if a text of any world is in no file.
    isAny() {
        this.editor.keep();
        return [...this.editor.scripts.values()].some((script) => unsavedIn(script) !== null);
    }

    // Asks the session to keep the texts of this world that are in no file.
    keep() {
        const { editor } = this;
        clearTimeout(this.timer);
        this.timer = undefined;
        editor.keep();
        for (const script of editor.scripts.values()) {
            const unsaved = unsavedIn(script);
            if (script.world === editor.world && unsaved !== script.unsaved) {
                script.unsaved = unsaved;
                editor.ask({ unsaved: { name: script.name, text: unsaved, over: script.sha256 } });
            }
        }
    }

    keepSoon() {
        this.timer ??= setTimeout(() => this.keep(), KEEP);
    }

    show() {
        // The session may offer what this page has: it knows no difference between this one and another one.
        this.offered = this.offered.filter(({ file, text }) => this.editor.scripts.get(file)?.state.doc.toString() !== text);
        const lines = this.offered.map((one) => element("li", {},
            element("span", {}, texts.unsaved(one.name, new Date(1000 * one.seconds)), ...(one.changed ? [element("b", {}, ` ${texts.unsavedOfOther}`)] : [])),
            element("button", { type: "button", title: texts.restoreTextHelp, onclick: () => this.restore(one) }, texts.restoreText),
            element("button", { type: "button", title: texts.discardHelp, onclick: () => this.discard(one) }, texts.discard)));
        part("unsaved").replaceChildren(...lines);
        part("unsaved").hidden = lines.length === 0;
        write(part("tab-script"), lines.length === 0 ? texts.tabScript : texts.unsavedMark);
    }

    /** @param {UnsavedText} one */
    restore(one) {
        this.restored = one;
        if (this.editor.shown?.name === one.name) {
            this.takeRestored();
        } else {
            part("script-name").value = one.name;
            this.editor.open(one.name);
        }
    }

    takeRestored() {
        const one = this.restored;
        if (one && this.editor.shown?.name === one.name) {
            this.restored = null;
            this.editor.replace(one.text);
            // The session forgets it when this page has it.
            this.forget(one);
            this.keep();
        }
    }

    /** @param {UnsavedText} one */
    discard(one) {
        this.editor.ask({ discard: { id: one.id } });
        this.forget(one);
    }

    /** @param {UnsavedText} one */
    forget(one) {
        this.offered = this.offered.filter((other) => other !== one);
        this.show();
    }
}

// Returns the text of a script if it is in no file.
/** @param {Script} script */
function unsavedIn({ kept, state }) {
    const text = state.doc.toString();
    return text === kept ? null : text;
}
