// The bar with tools, things and values while the world is built.

import { element, option, part } from "./element.js";
import { texts } from "./texts.js";
import { countOf, formOf, KINDS, TURN } from "./things.js";

/**
 * @import { Thing, ThingKind, ThingValues } from "./events"
 * @import { Builder } from "./builder.js"
 */

/** @typedef {"choose" | "robot" | "wall" | "box" | "disc" | "puck" | "lamp" | "paint"} Tool */

// In the order of their keys, from 1.
/** @type {Tool[]} */
export const TOOLS = ["choose", "robot", "wall", "box", "disc", "puck", "lamp", "paint"];

// Things of a kind in the list. The world has the others, too: a click chooses them.
const LISTED = 500;

export class BuildPanel {
    /** @param {Builder} builder */
    constructor(builder) {
        this.builder = builder;
        // The number of the group to which robots are added.
        this.group = 0;
        /** @type {(name: "copyThing" | "deleteThing" | "turnLeft" | "turnRight" | "undoBuild" | "redoBuild", act: () => void) => HTMLButtonElement} */
        const button = (name, act) => element("button", { type: "button", title: texts[`${name}Help`], onclick: () => builder.act(act) }, texts[name]);
        this.tools = TOOLS.map((tool) => element("button", {
            type: "button", "data-tool": tool, "aria-pressed": "false", title: texts.toolHelp[tool], onclick: () => builder.take(tool),
        }, texts.tools[tool]));
        this.groups = element("select", { "aria-label": texts.groupOfNew, onchange: () => { this.group = this.groups.selectedIndex; } });
        this.things = element("select", { id: "things", "aria-label": texts.thingsLabel, onchange: () => builder.choose(this.named(this.things.value)) });
        this.fields = element("span", { class: "fields" });
        this.copy = button("copyThing", () => builder.duplicate());
        this.delete = button("deleteThing", () => builder.delete());
        this.left = button("turnLeft", () => builder.turn(TURN));
        this.right = button("turnRight", () => builder.turn(-TURN));
        this.undo = button("undoBuild", () => builder.move("undo"));
        this.redo = button("redoBuild", () => builder.move("redo"));
        const done = element("button", { type: "button", class: "main", id: "build-done", title: texts.buildDoneHelp, onclick: () => builder.leave() }, texts.buildDone);
        part("build").append(
            element("div", {}, element("span", { role: "group", "aria-label": texts.toolsLabel, class: "tools" }, ...this.tools),
                this.left, this.right, this.copy, this.delete, this.undo, this.redo, done),
            element("div", { class: "values" }, this.groups, this.things, this.fields));
        // What the list shows, which is made anew only if that changes.
        this.listed = "";
        this.shown = "";
    }

    /** @returns {[ThingKind, number][]} */
    get counts() {
        return KINDS.map((kind) => [kind, countOf(this.builder.view, kind)]);
    }

    // The thing of an entry of the list.
    /**
     * @param {string} value
     * @returns {Thing | null}
     */
    named(value) {
        const [kind, number] = value.split(" ");
        return value === "" ? null : { kind: /** @type {ThingKind} */ (kind), number: Number(number) };
    }

    // Chooses the next thing of the list, or one before.
    /** @param {number} way */
    step(way) {
        const { options, selectedIndex } = this.things;
        const next = Math.max(1, Math.min(options.length - 1, selectedIndex + way));
        if (options.length > 1) {
            this.builder.choose(this.named(options[next].value));
        }
    }

    show() {
        const { builder } = this;
        const { world } = builder.view;
        if (!builder.isOn || !world) {
            return;
        }
        for (const tool of this.tools) {
            tool.setAttribute("aria-pressed", String(tool.dataset.tool === builder.tool));
        }
        this.groups.hidden = builder.tool !== "robot" || world.groups.length < 2;
        this.group = Math.min(this.group, world.groups.length - 1);
        this.groups.replaceChildren(...world.groups.map(({ name }, group) => option(name ?? "", String(group), group === this.group)));
        this.showThings();
        this.showFields();
        const has = builder.chosen !== null;
        const hasDirection = has && (builder.values?.heading !== undefined || builder.values?.from !== undefined);
        [this.left, this.right].forEach((button) => {
            button.disabled = !hasDirection;
        });
        [this.copy, this.delete].forEach((button) => {
            button.disabled = !has;
        });
        this.undo.disabled = builder.past.length === 0;
        this.redo.disabled = builder.future.length === 0;
    }

    showThings() {
        const { builder, counts } = this;
        const { robots } = builder.view;
        const ids = robots.ids.slice(0, LISTED).filter((_, robot) => robots.isThere[robot]).join();
        const forms = builder.view.world?.obstacles.map(formOf).join();
        const listed = JSON.stringify([counts, ids, forms]);
        if (listed !== this.listed) {
            this.listed = listed;
            const groups = counts.filter(([, count]) => count > 0).map(([kind, count]) => {
                const group = element("optgroup", { label: texts.thingKinds[kind] });
                const numbers = Array.from({ length: Math.min(count, LISTED) }, (_, number) => number);
                group.append(...numbers.filter((number) => kind !== "robot" || robots.isThere[number]).map((number) => option(builder.nameOf({ kind, number }), `${kind} ${number}`)));
                return group;
            });
            this.things.replaceChildren(option(texts.noThing, ""), ...groups);
        }
        const { chosen } = builder;
        const value = chosen ? `${chosen.kind} ${chosen.number}` : "";
        this.things.value = value;
        if (chosen && this.things.selectedIndex < 0) {
            // It is not among those that are listed.
            this.things.append(option(builder.nameOf(chosen), value, true));
            this.listed = "";
        }
    }

    // A field for each value of the chosen thing. What is being typed stays.
    showFields() {
        const { builder } = this;
        const { values } = builder;
        const fields = values ? fieldsOf(values) : [];
        const shown = JSON.stringify([builder.chosen, fields.map(([name]) => name)]);
        if (shown !== this.shown) {
            this.shown = shown;
            this.fields.replaceChildren(...fields.map(([name]) => this.field(name)));
        }
        [...this.fields.querySelectorAll("input")].forEach((input, index) => {
            const value = String(Math.round(fields[index][1] * 100) / 100);
            const isTyped = input === document.activeElement && input.value !== input.dataset.shown;
            input.dataset.shown = value;
            if (!isTyped) {
                input.value = value;
            }
        });
    }

    /** @param {Field[0]} name */
    field(name) {
        const { builder } = this;
        const input = element("input", { type: "number", step: "any", required: "", "aria-label": texts.valueLabels[name] });
        const change = () => {
            const set = builder.values && fieldsOf(builder.values).find(([other]) => other === name)?.[2];
            if (set && input.checkValidity()) {
                builder.change(set(Number(input.value)));
            }
        };
        input.addEventListener("change", () => {
            input.dataset.shown = input.value;
            builder.act(change);
        });
        return element("label", { title: texts.valueLabels[name] }, element("span", {}, texts.valueNames[name]), input);
    }
}

/**
 * A name, the value, and the values of the thing with another one.
 * @typedef {[keyof typeof texts.valueNames, number, (value: number) => ThingValues]} Field
 */

/**
 * @param {ThingValues} values
 * @returns {Field[]}
 */
function fieldsOf({ at, from, to, radius, size, heading, brightness }) {
    /** @type {Field[]} */
    const fields = [];
    if (at) {
        fields.push(["x", at[0], (x) => ({ at: [x, at[1]] })], ["y", at[1], (y) => ({ at: [at[0], y] })]);
    }
    if (from && to) {
        fields.push(["fromX", from[0], (x) => ({ from: [x, from[1]] })], ["fromY", from[1], (y) => ({ from: [from[0], y] })]);
        fields.push(["toX", to[0], (x) => ({ to: [x, to[1]] })], ["toY", to[1], (y) => ({ to: [to[0], y] })]);
    }
    if (radius !== undefined) {
        fields.push(["radius", radius, (value) => ({ radius: value })]);
    }
    if (size) {
        fields.push(["width", size[0], (value) => ({ size: [value, size[1]] })], ["height", size[1], (value) => ({ size: [size[0], value] })]);
    }
    if (heading !== undefined) {
        fields.push(["heading", heading, (value) => ({ heading: value })]);
    }
    if (brightness !== undefined) {
        fields.push(["brightness", brightness, (value) => ({ brightness: value })]);
    }
    return fields;
}
