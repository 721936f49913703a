// Parts of the page, and their texts.

import { texts } from "./texts.js";

export const part = (id) => document.getElementById(id);

export function element(name, attributes = {}, ...children) {
    const made = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) {
        if (key.startsWith("on")) {
            made.addEventListener(key.slice(2), value);
        } else {
            made.setAttribute(key, value);
        }
    }
    made.append(...children);
    return made;
}

// Returns a function that has `draw` called before the next picture, once however often it was asked.
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
export function save(blob, name) {
    const address = URL.createObjectURL(blob);
    element("a", { href: address, download: name }).click();
    URL.revokeObjectURL(address);
}

// A name and a value of a list.
export function row(name, ...value) {
    return element("div", {}, element("dt", {}, name), element("dd", {}, ...value));
}

// An action with an icon of index.html keeps it; its help is read out and shown.
export function fillTexts() {
    for (const one of document.querySelectorAll("[data-text]")) {
        one.textContent = texts[one.dataset.text];
    }
    for (const one of document.querySelectorAll("[data-help]")) {
        one.title = texts[one.dataset.help];
        if (!one.dataset.text && !one.querySelector("[data-text]")) {
            one.setAttribute("aria-label", one.title);
        }
    }
    for (const one of document.querySelectorAll("[data-label]")) {
        one.setAttribute("aria-label", texts[one.dataset.label]);
    }
}

export function showIcon(id, icon, text) {
    part(id).querySelector("use").setAttribute("href", `#i-${icon}`);
    part(id).querySelector("span").textContent = text;
}

// Moves with the arrow keys and shows the panel of the tab.
export class Tabs {
    constructor(names) {
        this.names = names;
        names.forEach((name) => {
            const tab = part(`tab-${name}`);
            tab.addEventListener("click", () => this.show(name));
            tab.addEventListener("keydown", ({ key }) => {
                const step = { ArrowRight: 1, ArrowLeft: names.length - 1 }[key];
                if (step) {
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

    show(shown) {
        this.shown = shown;
        document.body.dataset.tab = shown;
        for (const name of this.names) {
            const isShown = name === shown;
            part(name).hidden = !isShown;
            part(`tab-${name}`).setAttribute("aria-selected", isShown);
            part(`tab-${name}`).tabIndex = isShown ? 0 : -1;
        }
    }
}
