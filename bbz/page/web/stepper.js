// Line by line: the steps of one robot's script while the world waits.

import { part, write } from "./element.js";
import { Memory } from "./memory.js";
import { texts } from "./texts.js";

/**
 * @import { StatementDescription, StepTo } from "./events"
 * @import { Ask, World } from "./page"
 */

// The keys of steps. With Shift they are written in capitals.
/** @type {Record<string, StepTo>} */
const KEYS = { F7: "back", F8: "next", F10: "over", "Shift F8": "out" };

/** @type {[string, StepTo][]} */
const BUTTONS = [["step-back", "back"], ["step-in", "next"], ["step-over", "over"], ["step-out", "out"]];

export class Stepper {
    // `ask(request)` asks the session, `chosen()` is the number of the chosen robot or null, `idOf(robot)` its id.
    /**
     * @param {Ask} ask
     * @param {() => number | null} chosen
     * @param {(robot: number) => number} idOf
     */
    constructor(ask, chosen, idOf) {
        this.ask = ask;
        this.chosen = chosen;
        this.idOf = idOf;
        /** @type {World | null} */
        this.world = null;
        /** @type {StatementDescription | null} */
        this.at = null;
        this.memory = new Memory();
        for (const [id, to] of BUTTONS) {
            part(id).addEventListener("click", () => this.step(to));
        }
        part("step-values").addEventListener("toggle", () => this.showValues());
        addEventListener("keydown", (event) => {
            const to = KEYS[event.shiftKey ? `Shift ${event.key}` : event.key];
            const isOther = event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]");
            if (to && this.world?.scripts && !isOther) {
                event.preventDefault();
                this.step(to);
            }
        });
    }

    /** @param {World} world */
    begin(world) {
        this.world = world;
        this.show(null);
    }

    // The first step of a page without a chosen robot shows the first one.
    /** @param {StepTo} to */
    step(to) {
        this.ask({ debug: { robot: this.chosen() ?? 0, to } });
    }

    /** @param {StatementDescription | null} at */
    show(at) {
        this.at = at;
        part("step-at").hidden = !at;
        if (at) {
            const seconds = at.tick / (this.world?.ticks_per_second ?? 1);
            const { file, line, function: of } = at.place;
            write(part("step-place"), texts.statementAt(this.idOf(at.robot), `${file}:${line}`, of));
            write(part("step-number"), texts.statementOf(at.number + 1, at.count, seconds));
            // The editor shows the script of a robot, but not what that includes.
            write(part("step-text"), at.place.script ? "" : at.place.text ?? "");
            this.showValues();
        }
    }

    showValues() {
        if (this.at && part("step-values").open) {
            this.memory.showScript(part("step-memory"), this.at.memory);
        }
    }
}
