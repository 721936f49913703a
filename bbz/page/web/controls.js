// Sliders, switches and buttons that scripts ask for in comments: each sets a global of all robots.

import { element, part } from "./element.js";
import { texts } from "./texts.js";

/**
 * @import { Button, CommandDescription, Control, Slider, Switch } from "./events"
 */

/**
 * The elements of a control, and a function that shows a number in it.
 * @typedef {{ name: string, first: number, elements: (Node | string)[], write?: (number: number) => void }} Shown
 */

export class Controls {
    // `command(text)` gives a command.
    /** @param {(text: string) => void} command */
    constructor(command) {
        this.command = command;
        /** @type {Shown[]} */
        this.shown = [];
    }

    /** @param {Control[]} controls */
    begin(controls) {
        this.shown = controls.map((one) => {
            switch (one.kind) {
                case "slider": return this.slider(one);
                case "switch": return this.switch(one);
                case "button": return this.button(one);
            }
        });
        part("controls-of-scripts").replaceChildren(...this.shown.flatMap(({ name, elements, write }) =>
            (write ? [element("label", {}, element("span", {}, name), ...elements)] : elements)));
        part("controls-of-scripts").hidden = this.shown.length === 0;
    }

    /**
     * @param {Slider} slider
     * @returns {Shown}
     */
    slider({ name, least, most, step, value, is_float }) {
        const output = element("output");
        const input = element("input", { type: "range", min: least, max: most, step, value: value ?? least });
        const show = () => {
            output.textContent = texts.number(Number(input.value));
        };
        input.addEventListener("input", show);
        input.addEventListener("change", () => {
            // A float has a point also where it is whole.
            this.set(name, is_float && !input.value.includes(".") ? `${input.value}.0` : input.value);
        });
        show();
        const write = (/** @type {number} */ number) => {
            input.value = String(number);
            show();
        };
        return { name, first: value ?? least, elements: [input, output], write };
    }

    /**
     * @param {Switch} control
     * @returns {Shown}
     */
    switch({ name, value }) {
        const input = element("input", { type: "checkbox" });
        input.checked = Boolean(value);
        input.addEventListener("change", () => this.set(name, Number(input.checked)));
        const write = (/** @type {number} */ number) => {
            input.checked = Boolean(number);
        };
        return { name, first: value ?? 0, elements: [input], write };
    }

    /**
     * @param {Button} button
     * @returns {Shown}
     */
    button({ name }) {
        return { name, first: 0, elements: [element("button", { type: "button", onclick: () => this.set(name, 1) }, name)] };
    }

    /**
     * @param {string} name
     * @param {string | number} number
     */
    set(name, number) {
        this.command(`set = "all"\nglobal = "${name}"\nnumber = ${number}`);
    }

    // Shows the numbers that commands up to a tick have set, also after a way back.
    /**
     * @param {CommandDescription[]} commands
     * @param {number} tick
     */
    follow(commands, tick) {
        /** @type {Map<string, number>} */
        const set = new Map();
        for (const { text } of commands.filter((one) => one.tick <= tick)) {
            if (/^load\b/.test(text) && !/^keep = true$/m.test(text)) {
                set.clear();
            }
            const [, name, number] = text.match(/^set[^]*^global = "(\w+)"\s^number = (\S+)$/m) ?? [];
            if (name !== undefined) {
                set.set(name, Number(number));
            }
        }
        for (const { name, first, write } of this.shown) {
            write?.(set.get(name) ?? first);
        }
    }
}
