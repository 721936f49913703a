// The time line: where the run is, and marks for what happened.

import { element, onFrame, part } from "./element.js";
import { texts } from "./texts.js";

// The greatest number of marks of one kind: more cannot be distinguished.
const MARKS_MAX = 400;

// Characters of a text from which on no more is added: all robots may fail at once.
const TEXT_MAX = 1000;

export class TimeLine {
    // `onGo(tick)` when the user drags the slider, or presses a mark.
    /** @param {(tick: number) => void} onGo */
    constructor(onGo) {
        this.onGo = onGo;
        this.end = 1;
        this.ticksPerSecond = 1;
        this.slider = part("time");
        this.slider.addEventListener("input", () => onGo(Number(this.slider.value)));
        // The texts of the marks by kind and tick.
        /** @type {Map<string, Map<number, string>>} */
        this.marks = new Map();
        this.changed = onFrame(() => this.draw());
        // Of all marks, one can be reached by the tab key: that which had the focus last.
        this.reached = "";
        part("marks").addEventListener("keydown", (event) => this.key(event));
    }

    /**
     * @param {number} end
     * @param {number} ticksPerSecond
     */
    begin(end, ticksPerSecond) {
        this.end = end;
        this.ticksPerSecond = ticksPerSecond;
        this.slider.max = String(end);
        this.marks.clear();
        this.changed();
    }

    /**
     * @param {number} tick
     * @param {boolean} isPlaying
     * @param {string} clock the tick in words
     */
    show(tick, isPlaying, clock) {
        // A slider that is dragged is ahead of the run.
        if (isPlaying || !this.slider.matches(":active")) {
            this.slider.value = String(tick);
        }
        // A screen reader reads each value of a slider that has the focus.
        if (!(isPlaying && this.slider.matches(":focus"))) {
            this.slider.setAttribute("aria-valuetext", clock);
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
        const marks = [...this.marks].flatMap(([kind, ticks]) => [...ticks].map(([tick, text]) => ({ kind, tick, text })));
        marks.sort((one, other) => one.tick - other.tick);
        const hadFocus = part("marks").contains(document.activeElement);
        const all = marks.map(({ kind, tick, text }) => {
            const mark = element("button", {
                type: "button", class: kind, title: text, "aria-label": texts.markAt(tick / this.ticksPerSecond, text), tabindex: -1,
                "data-tick": tick, onclick: () => this.onGo(tick), onfocus: () => this.reach(mark),
            });
            // By the object model: the page's policy allows no styles in attributes.
            mark.style.left = `${(100 * tick) / this.end}%`;
            return mark;
        });
        part("marks").replaceChildren(...all);
        const again = all.find((mark) => nameOf(mark) === this.reached) ?? all[0];
        if (again) {
            again.tabIndex = 0;
            if (hadFocus) {
                again.focus();
            }
        }
    }

    /** @param {HTMLElement} mark */
    reach(mark) {
        for (const one of part("marks").querySelectorAll("button")) {
            one.tabIndex = one === mark ? 0 : -1;
        }
        this.reached = nameOf(mark);
    }

    /** @param {KeyboardEvent} event */
    key(event) {
        const all = [...part("marks").querySelectorAll("button")];
        const at = all.findIndex((mark) => mark === document.activeElement);
        /** @type {Record<string, number>} */
        const ways = { ArrowLeft: at - 1, ArrowRight: at + 1, Home: 0, End: all.length - 1 };
        const next = all[ways[event.key]];
        if (event.key in ways) {
            // The beginning of the run has another key here.
            event.preventDefault();
            event.stopPropagation();
            next?.focus();
        }
    }
}

/** @param {HTMLElement} mark */
function nameOf(mark) {
    return `${mark.className} ${mark.dataset.tick}`;
}
