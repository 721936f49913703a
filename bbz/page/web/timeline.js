// The time line: where the run is, and marks for what happened.

import { element, onFrame, part } from "./element.js";

// The greatest number of marks of one kind: more cannot be distinguished.
const MARKS_MAX = 400;

// Characters of a text from which on no more is added: all robots may fail at once.
const TEXT_MAX = 1000;

export class TimeLine {
    // `onGo(tick)` when the user drags the slider.
    /** @param {(tick: number) => void} onGo */
    constructor(onGo) {
        this.end = 1;
        this.slider = part("time");
        this.slider.addEventListener("input", () => onGo(Number(this.slider.value)));
        // The texts of the marks by kind and tick.
        /** @type {Map<string, Map<number, string>>} */
        this.marks = new Map();
        this.changed = onFrame(() => this.draw());
    }

    /** @param {number} end */
    begin(end) {
        this.end = end;
        this.slider.max = String(end);
        this.marks.clear();
        this.changed();
    }

    /**
     * @param {number} tick
     * @param {boolean} isPlaying
     */
    show(tick, isPlaying) {
        // A slider that is dragged is ahead of the run.
        if (isPlaying || !this.slider.matches(":active")) {
            this.slider.value = String(tick);
        }
    }

    // Kinds are the classes of the style sheet: event, command, fault, held, failed.
    /**
     * @param {string} kind
     * @param {number} tick
     * @param {string} text
     */
    mark(kind, tick, text) {
        const marks = this.marks.get(kind) ?? new Map();
        this.marks.set(kind, marks);
        const known = marks.get(tick);
        if (known !== undefined) {
            // A mark that an earlier run of the same tick has made is there once.
            marks.set(tick, known.includes(text) || known.length > TEXT_MAX ? known : `${known}\n${text}`);
        } else if (marks.size < MARKS_MAX) {
            marks.set(tick, text);
        }
        this.changed();
    }

    // Forgets the marks of a kind that come after a tick.
    /**
     * @param {string} kind
     * @param {number} tick
     */
    forget(kind, tick) {
        const marks = this.marks.get(kind) ?? new Map();
        [...marks.keys()].filter((at) => at > tick).forEach((at) => marks.delete(at));
        this.changed();
    }

    draw() {
        const all = [];
        for (const [kind, marks] of this.marks) {
            for (const [tick, text] of marks) {
                const mark = element("i", { class: kind, title: text });
                // By the object model: the page's policy allows no styles in attributes.
                mark.style.left = `${(100 * tick) / this.end}%`;
                all.push(mark);
            }
        }
        part("marks").replaceChildren(...all);
    }
}
