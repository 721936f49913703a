// The lines that robots logged, the faults of scripts, the expectations and the measures.

import { element, inside, part, write } from "./element.js";
import { texts } from "./texts.js";

// Lines that are kept.
const LINES_MAX = 500;

// Milliseconds from one change of what is shown to the next. Robots may log thousands of lines per second.
const PAUSE = 150;

/**
 * @import { Expectation } from "./page"
 * @import { MeasureDescription } from "./events"
 */

/**
 * A line: the tick that it is about, and a function that makes its element.
 * @typedef {{ tick: number, element: () => HTMLElement }} Line
 */

export class Log {
    // `onChoose(robot)` when the user chooses the robot of a line, `onExplain(code)` when the user asks for the meaning of an error.
    /**
     * @param {(robot: number) => void} onChoose
     * @param {(code: string) => void} onExplain
     */
    constructor(onChoose, onExplain) {
        this.onChoose = onChoose;
        this.onExplain = onExplain;
        /** @type {Line[]} */
        this.lines = [];
        // The lines that are shown, with their elements.
        /** @type {Map<Line, HTMLElement>} */
        this.shown = new Map();
        this.timer = 0;
        this.draw();
    }

    clear() {
        this.lines = [];
        this.draw();
    }

    /**
     * @param {number} tick
     * @param {number} seconds
     * @param {number} robot its number
     * @param {number} id
     * @param {() => (string | Node)[]} content
     * @param {string} kind
     * @param {string} [code] that of an error
     */
    add(tick, seconds, robot, id, content, kind, code) {
        const choose = () => this.onChoose(robot);
        this.put({ tick, element: () => element("p", { class: kind },
            element("time", {}, seconds.toFixed(1)),
            element("button", { type: "button", title: texts.robot(id), onclick: choose }, String(id)),
            element("span", {}, ...content(),
                ...(code ? [element("button", { type: "button", title: texts.explainHelp, onclick: () => this.onExplain(code) }, texts.explain)] : []))) });
    }

    // Shows that lines are left out.
    /**
     * @param {number} tick
     * @param {number} count
     */
    lose(tick, count) {
        this.put({ tick, element: () => element("p", { class: "lost" }, texts.lostLines(count)) });
    }

    /** @param {Line} line */
    put(line) {
        this.lines.push(line);
        if (this.lines.length > 2 * LINES_MAX) {
            this.lines.splice(0, this.lines.length - LINES_MAX);
        }
        if (this.timer === 0) {
            this.draw();
            this.timer = setTimeout(() => {
                this.timer = 0;
                this.draw();
            }, PAUSE);
        }
    }

    // Shows the last lines. Elements of lines that remain are kept, with the focus.
    draw() {
        const log = part("log");
        const lines = this.lines.slice(-LINES_MAX);
        if (lines.length > 0 && lines.length === this.shown.size && this.shown.has(lines[lines.length - 1])) {
            return;
        }
        const isAtEnd = log.scrollTop + log.clientHeight > log.scrollHeight - 30;
        const before = this.shown;
        this.shown = new Map(lines.map((line) => [line, before.get(line) ?? line.element()]));
        for (const [line, old] of before) {
            if (!this.shown.has(line)) {
                old.remove();
            }
        }
        log.querySelector(".none")?.remove();
        log.append(...lines.filter((line) => !before.has(line)).map((line) => this.shown.get(line) ?? ""));
        if (lines.length === 0) {
            log.replaceChildren(element("p", { class: "none" }, texts.noLog));
        }
        if (isAtEnd) {
            log.scrollTop = log.scrollHeight;
        }
    }

    // Forgets what comes again when the run goes on from a tick.
    /** @param {number} tick */
    forget(tick) {
        this.lines = this.lines.filter((line) => line.tick < tick);
        this.draw();
    }
}

// `older` is the reason why the verdicts are not of the texts that are shown, or null.
/**
 * @param {Expectation[]} expectations
 * @param {keyof typeof texts.older | null} older
 */
export function showTests(expectations, older) {
    const lines = expectations.map(({ verdict = "open", name, text }) => element("p", { class: verdict },
        element("b", {}, texts.verdicts[verdict]),
        element("span", {}, name ? `${name}: ${text}` : text, ...(older ? [element("small", {}, ` (${texts.ofOlder})`)] : []))));
    part("expectations").replaceChildren(...(lines.length > 0 ? lines : [element("p", { class: "none" }, texts.noTests)]));
    const held = expectations.filter(({ verdict }) => verdict === "held").length;
    write(part("verdicts"), lines.length > 0 ? texts.lightsOf(held, lines.length) : "");
    const reason = older && lines.length > 0 ? texts.older[older] : "";
    if (part("older").textContent !== reason) {
        // A screen reader reads it only when it changes.
        write(part("older"), reason);
    }
    document.body.classList.toggle("older", older !== null);
}

// `values` are those that are known, `null` for the others; `isOver` if the run has ended.
/**
 * @param {MeasureDescription[]} measures
 * @param {(number | null)[]} values
 * @param {boolean} isOver
 */
export function showMeasures(measures, values, isOver) {
    const lines = measures.map(({ name, text, is_time: isTime }, number) => element("p", {},
        element("b", {}, texts.measured(values[number] ?? null, isTime, isOver)),
        element("span", {}, `${name}: ${text}`)));
    inside(part("measures"), "div").replaceChildren(...lines);
    part("measures").hidden = measures.length === 0;
}
