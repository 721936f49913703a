// The panel of the chosen robot.

import { meaningOf } from "./about.js";
import { element, part, row } from "./element.js";
import { faultParts } from "./fault.js";
import { led } from "./glyph.js";
import { Memory } from "./memory.js";
import { Questions } from "./questions.js";
import { texts } from "./texts.js";

/**
 * @import { AttitudeDescription, InspectionEvent } from "./events"
 * @import { OpenPlace } from "./fault.js"
 * @import { Place, World } from "./page"
 * @import { Robots } from "./recording.js"
 */

/** @type {("fail" | "stop" | "resume" | "restart")[]} */
const ACTIONS = ["fail", "stop", "resume", "restart"];

export class RobotPanel {
    // `command(text)` gives a command.
    // `compare(robot)` shows its curve next to others, or hides it.
    // `openPlace(fault, place)` shows the place of a fault in the editor.
    /**
     * @param {Robots} robots
     * @param {(text: string) => void} command
     * @param {(robot: number) => void} compare
     * @param {OpenPlace} openPlace
     */
    constructor(robots, command, compare, openPlace) {
        this.robots = robots;
        this.command = command;
        this.compare = compare;
        this.openPlace = openPlace;
        this.questions = new Questions(command);
        this.memory = new Memory();
        this.memoryAtFault = new Memory();
        /** @type {World | null} */
        this.world = null;
        /** @type {number | null} */
        this.robot = null;
        /** @type {InspectionEvent | null} */
        this.inspection = null;
        // The attitudes of the robots that tilt.
        /** @type {AttitudeDescription[]} */
        this.attitudes = [];
        /** @type {HTMLElement | null} */
        this.isCompared = null;
        this.facts = element("dl", { class: "facts" });
        this.fault = element("p", { class: "fault", role: "alert", hidden: "" });
        this.atFault = element("details", { hidden: "" });
        // Tells the fault that is shown from the next one.
        this.shownFault = "";
        this.parts = element("div", { class: "memory" });
        this.choose(null);
    }

    /**
     * @param {World} world
     * @param {number | null} chosen
     */
    begin(world, chosen) {
        this.world = world;
        this.attitudes = [];
        this.questions.begin(world.ticks_per_second);
        this.choose(chosen);
    }

    /** @param {number | null} robot */
    choose(robot) {
        this.robot = robot;
        this.inspection = null;
        const panel = part("robot");
        if (robot === null || !this.world) {
            panel.replaceChildren(element("p", { class: "none" }, texts.noRobot));
            return;
        }
        const id = this.idOf(robot);
        this.questions.choose(robot, id);
        const act = (/** @type {typeof ACTIONS[number]} */ name) => element("button",
            { type: "button", title: texts[`${name}Help`], onclick: () => this.command(`${name} = ${id}`) }, texts[name]);
        const link = (/** @type {"block" | "restore"} */ name) => element("button",
            { type: "button", title: texts[`${name}Help`], onclick: () => this.command(`${name} = [${id}, "all"]`) }, texts[name]);
        this.facts = element("dl", { class: "facts" });
        this.fault = element("p", { class: "fault", role: "alert", hidden: "" });
        this.atFault = element("details", { class: "at-fault", open: "", hidden: "" });
        this.shownFault = "";
        this.parts = element("div", { class: "memory" });
        this.isCompared = element("button",
            { type: "button", title: texts.compareHelp, "aria-pressed": false, onclick: () => this.compare(robot) }, texts.compare);
        panel.replaceChildren(element("div", { class: "title" }, element("h2", {}, texts.robot(id)), this.isCompared), this.facts, this.questions.element, this.fault, this.atFault,
            element("div", { class: "acts" }, ...ACTIONS.map(act), link("block"), link("restore")), this.place(), this.parts);
        this.show();
    }

    /** @param {(number | null)[]} compared */
    showCompared(compared) {
        this.isCompared?.setAttribute("aria-pressed", String(this.robot !== null && compared.includes(this.robot)));
    }

    /** @param {number} robot */
    idOf(robot) {
        return this.robots.ids[robot] ?? robot;
    }

    // A way to move the robot without a mouse.
    place() {
        const field = (/** @type {string} */ label) => element("input", { type: "number", step: "any", required: "", "aria-label": label, placeholder: label });
        const [x, y] = [field(texts.x), field(texts.y)];
        const go = (/** @type {Event} */ event) => {
            event.preventDefault();
            if (this.robot !== null) {
                this.move([Number(x.value), Number(y.value)], this.robot);
            }
        };
        return element("form", { class: "place", onsubmit: go },
            x, y, element("button", { title: texts.moveHelp }, texts.move));
    }

    /**
     * @param {Place} place
     * @param {number} robot
     */
    move([x, y], robot) {
        this.command(`move = ${this.robots.ids[robot]}\nto = [${x.toFixed(1)}, ${y.toFixed(1)}]`);
    }

    /** @param {InspectionEvent} inspection */
    inspect(inspection) {
        if (inspection.robot === this.robot) {
            this.inspection = inspection;
            this.show();
        }
    }

    show() {
        const { robots, robot, world } = this;
        const group = world?.groups.find(({ first, count }) => robot !== null && robot < first + count);
        if (robot === null || !world || !group) {
            return;
        }
        const [x, y, z] = [robots.x, robots.y, robots.z].map((axis) => axis[robot] / 10);
        const degrees = (robots.heading[robot] * 360) / 65536;
        const rows = [
            row(texts.state, element("span", { class: `state s${robots.state[robot]}` }, texts.states[robots.state[robot]])),
            ...(world.recording ? [] : [row(texts.group, `${group.name} (${group.robot})`), row(texts.script, group.script ?? "")]),
            ...(world.watched ? [] : [row(texts.place, texts.placeOf(x, y, z, degrees))]),
            ...(world.recording ? [row(texts.radius, texts.radiusOf(group.radius))] : []),
        ];
        const color = robots.led[robot];
        rows.push(...(world.watched ? [] : [row(texts.led, ...(color > 0 ? [led(color)] : []), texts.ledOf(color, meaningOf(world, group, color)))]));
        if (group.link) {
            rows.push(row(texts.range, texts.rangeOf(group.link)));
        }
        const attitude = this.attitudes.find((one) => one.robot === robot);
        if (attitude) {
            rows.push(row(texts.attitude, texts.attitudeOf(attitude)));
        }
        const estimate = this.inspection?.estimate ?? null;
        if (estimate !== null && !world.watched) {
            const away = Math.hypot(...estimate.map((mm, axis) => mm - [x, y, z][axis]));
            rows.push(row(texts.estimate, texts.estimateOf(...estimate, away)));
        }
        const battery = this.inspection?.battery ?? null;
        if (battery !== null) {
            const { millivolts, charge } = battery;
            rows.push(row(texts.battery, ...(charge === null ? [] : [element("meter", { min: 0, max: 1, value: charge }), " "]),
                texts.batteryOf(millivolts, charge)));
        }
        const memory = this.inspection?.memory;
        if (memory) {
            const { stack, heap, free } = memory.slots;
            rows.push(row(texts.memory, element("meter", { min: 0, max: stack + heap + free, value: stack + heap }),
                ` ${texts.memoryOf(stack + heap, stack + heap + free)}`));
        }
        this.facts.replaceChildren(...rows);
        this.showFault(world.ticks_per_second);
        if (memory) {
            this.memory.show(this.parts, memory);
        } else if (this.inspection) {
            this.parts.replaceChildren(element("p", { class: "none" }, texts.noMemory));
        }
    }

    /** @param {number} ticksPerSecond */
    showFault(ticksPerSecond) {
        const fault = this.inspection?.fault ?? null;
        // Buttons that are replaced with every sample could not be pressed.
        const shown = JSON.stringify(fault);
        if (shown === this.shownFault) {
            return;
        }
        this.shownFault = shown;
        this.fault.hidden = !fault;
        const held = this.inspection?.at_fault ?? null;
        this.atFault.hidden = !held;
        if (fault) {
            const seconds = fault.tick / ticksPerSecond;
            this.fault.replaceChildren(texts.faultAt(fault.code, seconds), ...faultParts(fault, this.openPlace));
            const memory = element("div", { class: "memory" });
            this.atFault.replaceChildren(element("summary", {}, texts.memoryAtFault(seconds)), memory);
            if (held) {
                this.memoryAtFault.showScript(memory, held);
            }
        }
    }

    // The robots from which the chosen one has received messages lately.
    get neighbors() {
        return this.inspection?.memory?.neighbors.map(({ id }) => id) ?? [];
    }
}
