// The panel of the chosen robot.

import { element, part, row } from "./element.js";
import { Memory } from "./memory.js";
import { texts } from "./texts.js";

const ACTIONS = ["fail", "stop", "resume", "restart"];

export class RobotPanel {
    // `command(text)` gives a command.
    // `compare(robot)` shows its curve beside others, or no more.
    constructor(robots, command, compare) {
        Object.assign(this, { robots, command, compare });
        this.memory = new Memory();
        this.choose(null);
    }

    begin(world, chosen) {
        this.world = world;
        this.choose(chosen);
    }

    choose(robot) {
        this.robot = robot;
        this.inspection = null;
        const panel = part("robot");
        if (robot === null || !this.world) {
            panel.replaceChildren(element("p", { class: "none" }, texts.noRobot));
            return;
        }
        const id = this.id;
        const act = (name) => element("button",
            { type: "button", title: texts[`${name}Help`], onclick: () => this.command(`${name} = ${id}`) }, texts[name]);
        const link = (name) => element("button",
            { type: "button", title: texts[`${name}Help`], onclick: () => this.command(`${name} = [${id}, "all"]`) }, texts[name]);
        this.facts = element("dl", { class: "facts" });
        this.fault = element("p", { class: "fault", role: "alert", hidden: "" });
        this.parts = element("div", { class: "memory" });
        this.isCompared = element("button",
            { type: "button", title: texts.compareHelp, "aria-pressed": false, onclick: () => this.compare(robot) }, texts.compare);
        panel.replaceChildren(element("h2", {}, texts.robot(id)), this.facts, this.fault,
            element("div", { class: "acts" }, ...ACTIONS.map(act), link("block"), link("restore"), this.isCompared), this.place(), this.parts);
        this.show();
    }

    showCompared(compared) {
        this.isCompared?.setAttribute("aria-pressed", this.robot !== null && compared.includes(this.robot));
    }

    get id() {
        return this.robots.ids[this.robot] ?? this.robot;
    }

    // A way to move the robot without a mouse.
    place() {
        const field = (label) => element("input", { type: "number", step: "any", required: "", "aria-label": label, placeholder: label });
        const [x, y] = [field(texts.x), field(texts.y)];
        const go = (event) => {
            event.preventDefault();
            this.move([Number(x.value), Number(y.value)]);
        };
        return element("form", { class: "place", onsubmit: go },
            x, y, element("button", { title: texts.moveHelp }, texts.move));
    }

    move([x, y], robot = this.robot) {
        this.command(`move = ${this.robots.ids[robot]}\nto = [${x.toFixed(1)}, ${y.toFixed(1)}]`);
    }

    inspect(inspection) {
        if (inspection.robot === this.robot) {
            this.inspection = inspection;
            this.show();
        }
    }

    show() {
        if (this.robot === null || !this.world) {
            return;
        }
        const { robots, robot } = this;
        const group = this.world.groups.find(({ first, count }) => robot < first + count);
        const [x, y, z] = [robots.x, robots.y, robots.z].map((axis) => axis[robot] / 10);
        const degrees = (robots.heading[robot] * 360) / 65536;
        const rows = [
            row(texts.state, element("span", { class: `state s${robots.state[robot]}` }, texts.states[robots.state[robot]])),
            ...(this.world.recording ? [] : [row(texts.group, `${group.name} (${group.robot})`), row(texts.script, group.script)]),
            ...(this.world.watched ? [] : [row(texts.place, texts.placeOf(x, y, z, degrees))]),
        ];
        const battery = this.inspection?.battery_mv ?? null;
        if (battery !== null) {
            rows.push(row(texts.battery, texts.volts(battery)));
        }
        const memory = this.inspection?.memory;
        if (memory) {
            const { stack, heap, free } = memory.slots;
            rows.push(row(texts.memory, element("meter", { min: 0, max: stack + heap + free, value: stack + heap }),
                ` ${texts.memoryOf(stack + heap, stack + heap + free)}`));
        }
        this.facts.replaceChildren(...rows);
        this.showFault();
        if (memory) {
            this.memory.show(this.parts, memory);
        } else if (this.inspection) {
            this.parts.replaceChildren(element("p", { class: "none" }, texts.noMemory));
        }
    }

    showFault() {
        const fault = this.inspection?.fault;
        this.fault.hidden = !fault;
        if (fault) {
            const seconds = fault.tick / this.world.ticks_per_second;
            this.fault.textContent = texts.faultAt(fault.code, fault.places[0], seconds);
        }
    }

    // The robots that the chosen one has heard lately.
    get neighbors() {
        return this.inspection?.memory?.neighbors.map(({ id }) => id) ?? [];
    }
}
