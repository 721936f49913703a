// The lines that robots logged, the faults of scripts, and the expectations.

import { element, part } from "./element.js";
import { texts } from "./texts.js";

// Lines that are kept.
const LINES_MAX = 500;

/**
 * @import { Expectation } from "./page"
 */

/**
 * A line with the tick that it is about.
 * @typedef {HTMLElement & { tick: number }} Line
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
        this.clear();
    }

    clear() {
        part("log").replaceChildren(element("p", { class: "none" }, texts.noLog));
    }

    /**
     * @param {number} tick
     * @param {number} seconds
     * @param {number} robot its number
     * @param {number} id
     * @param {(string | Node)[]} content
     * @param {string} kind
     * @param {string} [code] that of an error
     */
    add(tick, seconds, robot, id, content, kind, code) {
        const log = part("log");
        log.querySelector(".none")?.remove();
        const isAtEnd = log.scrollTop + log.clientHeight > log.scrollHeight - 30;
        const choose = () => this.onChoose(robot);
        const line = element("p", { class: kind },
            element("time", {}, seconds.toFixed(1)),
            element("button", { type: "button", title: texts.robot(id), onclick: choose }, String(id)),
            element("span", {}, ...content,
                ...(code ? [element("button", { type: "button", title: texts.explainHelp, onclick: () => this.onExplain(code) }, texts.explain)] : [])));
        log.append(Object.assign(line, { tick }));
        while (log.childElementCount > LINES_MAX) {
            log.firstElementChild?.remove();
        }
        if (isAtEnd) {
            log.scrollTop = log.scrollHeight;
        }
    }

    // Forgets what comes again when the run goes on from a tick.
    /** @param {number} tick */
    forget(tick) {
        const lines = /** @type {Line[]} */ ([...part("log").children]);
        lines.filter((line) => line.tick >= tick).forEach((line) => line.remove());
        if (!part("log").hasChildNodes()) {
            this.clear();
        }
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
    const reason = older && lines.length > 0 ? texts.older[older] : "";
    if (part("older").textContent !== reason) {
        // A screen reader reads it only when it changes.
        part("older").textContent = reason;
    }
    document.body.classList.toggle("older", older !== null);
}
