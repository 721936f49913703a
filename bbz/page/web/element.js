// Parts of the page, and their texts.

import { language, texts } from "./texts.js";

/**
 * @import { Parts } from "./page"
 */

/**
 * @template {string} Id
 * @param {Id} id of an element of index.html
 */
export function part(id) {
    return /** @type {Id extends keyof Parts ? Parts[Id] : HTMLElement} */ (document.getElementById(id));
}

// Returns the first element inside another one that matches; index.html has it.
/**
 * @template {Element} [Found=HTMLElement]
 * @param {ParentNode} parent
 * @param {string} selector
 */
export function inside(parent, selector) {
    return /** @type {Found} */ (parent.querySelector(selector));
}

// Characters that control a terminal or turn the direction of text: C0 but line breaks and tabs, DEL, C1, and the controls of Unicode
// Standard Annex 9. What `bbz` prints is filtered in the same way (bbz/src/escape.rs).
const CONTROLS = /(?!\t|\r?\n)[\p{Cc}\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069]/gu;

// Returns a text whose controls are written as `\u001b`: names, lines and messages may come from anywhere.
/** @param {string} text */
export function printable(text) {
    return text.replace(CONTROLS, (control) => `\\u${control.charCodeAt(0).toString(16).padStart(4, "0")}`);
}

// Gives an element a text.
/**
 * @param {Element} where
 * @param {string} text
 */
export function write(where, text) {
    where.textContent = printable(text);
}

// Returns an option of a list.
/**
 * @param {string} text
 * @param {string} [value]
 * @param {boolean} [isChosen]
 */
export function option(text, value = text, isChosen = false) {
    return new Option(printable(text), value, isChosen, isChosen);
}

// Attributes that are read.
const READ = ["title", "aria-label", "label"];

/**
 * @template {keyof HTMLElementTagNameMap} Name
 * @param {Name} name
 * @param {Record<string, string | number | boolean | ((event: any) => void)>} attributes listeners are named `on…`
 * @param {(Node | string)[]} children
 */
export function element(name, attributes = {}, ...children) {
    const made = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) {
        if (typeof value === "function") {
            made.addEventListener(key.slice(2), value);
        } else {
            made.setAttribute(key, READ.includes(key) ? printable(String(value)) : String(value));
        }
    }
    made.append(...children.map((child) => (typeof child === "string" ? printable(child) : child)));
    return made;
}

// Returns a function that has `draw` called before the next picture, once however often it was asked.
/** @param {() => void} draw */
export function onFrame(draw) {
    let isAsked = false;
    return () => {
        if (!isAsked) {
            isAsked = true;
            requestAnimationFrame(() => {
                isAsked = false;
                draw();
            });
        }
    };
}

// Gives the browser a file to keep.
/**
 * @param {Blob} blob
 * @param {string} name
 */
export function save(blob, name) {
    const address = URL.createObjectURL(blob);
    element("a", { href: address, download: name }).click();
    URL.revokeObjectURL(address);
}

// Gives the browser a table to keep, which a terminal may show.
/**
 * @param {string} text
 * @param {string} name
 */
export function saveTable(text, name) {
    save(new Blob([printable(text)], { type: "text/csv" }), name);
}

// A name and a value of a list.
/**
 * @param {string | Node} name
 * @param {(string | Node)[]} value
 */
export function row(name, ...value) {
    return element("div", {}, element("dt", {}, name), element("dd", {}, ...value));
}

// An action with an icon of index.html keeps it; its help is read out and shown.
export function fillTexts() {
    document.documentElement.lang = language;
    /** @type {(name: string | undefined) => string} */
    const text = (name) => /** @type {Record<string, any>} */ (texts)[name ?? ""];
    /** @type {(selector: string) => NodeListOf<HTMLElement>} */
    const all = (selector) => document.querySelectorAll(selector);
    for (const one of all("[data-text]")) {
        one.textContent = text(one.dataset.text);
    }
    for (const one of all("[data-help]")) {
        one.title = text(one.dataset.help);
        if (!one.dataset.text && !one.querySelector("[data-text]")) {
            one.setAttribute("aria-label", one.title);
        }
    }
    for (const one of all("[data-label]")) {
        one.setAttribute("aria-label", text(one.dataset.label));
    }
}

/**
 * @param {string} id
 * @param {string} icon
 * @param {string} text
 */
export function showIcon(id, icon, text) {
    inside(part(id), "use").setAttribute("href", `#i-${icon}`);
    inside(part(id), "span").textContent = text;
}

// Moves with the arrow keys and shows the panel of the tab.
export class Tabs {
    /**
     * @param {string[]} names
     * @param {(name: string) => void} onShow
     */
    constructor(names, onShow) {
        this.names = names;
        this.onShow = onShow;
        this.shown = "";
        names.forEach((name) => {
            const tab = part(`tab-${name}`);
            tab.addEventListener("click", () => this.show(name));
            tab.addEventListener("keydown", ({ key }) => {
                const step = key === "ArrowRight" ? 1 : key === "ArrowLeft" ? names.length - 1 : 0;
                if (step > 0) {
                    let next = name;
                    do {
                        next = names[(names.indexOf(next) + step) % names.length];
                        // A recording, for example, has no scripts.
                    } while (next !== name && part(`tab-${next}`).offsetParent === null);
                    this.show(next);
                    part(`tab-${next}`).focus();
                }
            });
        });
        this.show(names[0]);
    }

    /** @param {string} shown */
    show(shown) {
        this.shown = shown;
        document.body.dataset.tab = shown;
        for (const name of this.names) {
            const isShown = name === shown;
            part(name).hidden = !isShown;
            part(`tab-${name}`).setAttribute("aria-selected", String(isShown));
            part(`tab-${name}`).tabIndex = isShown ? 0 : -1;
        }
        this.onShow(shown);
    }
}
