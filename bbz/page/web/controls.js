// Sliders, switches and buttons that scripts ask for in comments: each sets a global of all robots.

import { element, part } from "./element.js";
import { texts } from "./texts.js";

export class Controls {
    // `command(text)` gives a command.
    constructor(command) {
        this.command = command;
        this.shown = [];
    }

    // `described` is the list of the event (crate live, controls.rs).
    begin(described) {
        this.shown = described;
        described.forEach((one) => {
            one.input = this[one.kind](one);
        });
        part("controls-of-scripts").replaceChildren(...this.shown.map(({ name, kind, input, output }) =>
            (kind === "button" ? input : element("label", {}, element("span", {}, name), input, output ?? ""))));
        part("controls-of-scripts").hidden = this.shown.length === 0;
    }

    slider(one) {
        const { least, most, step, value, is_float } = one;
        one.output = element("output");
        const input = element("input", { type: "range", min: least, max: most, step, value: value ?? least });
        const write = () => {
            one.output.textContent = texts.number(Number(input.value));
        };
        input.addEventListener("input", write);
        input.addEventListener("change", () => {
            // A float has a point also where it is whole.
            this.set(one.name, is_float && !input.value.includes(".") ? `${input.value}.0` : input.value);
        });
        one.write = (number) => {
            input.value = number;
            write();
        };
        write();
        return input;
    }

    switch(one) {
        const input = element("input", { type: "checkbox" });
        input.checked = Boolean(one.value);
        input.addEventListener("change", () => this.set(one.name, Number(input.checked)));
        one.write = (number) => {
            input.checked = Boolean(number);
        };
        return input;
    }

    button(one) {
        return element("button", { type: "button", onclick: () => this.set(one.name, 1) }, one.name);
    }

    set(name, number) {
        this.command(`set = "all"\nglobal = "${name}"\nnumber = ${number}`);
    }

    // Shows the numbers that commands up to a tick have set, also after a way back.
    follow(commands, tick) {
        const set = new Map();
        for (const { text } of commands.filter((one) => one.tick <= tick)) {
            if (/^load\b/.test(text) && !/^keep = true$/m.test(text)) {
                set.clear();
            }
            const [, name, number] = text.match(/^set[^]*^global = "(\w+)"\s^number = (\S+)$/m) ?? [];
            set.set(name, Number(number));
        }
        for (const { name, value, least, write } of this.shown) {
            write?.(set.get(name) ?? value ?? least ?? 0);
        }
    }
}
