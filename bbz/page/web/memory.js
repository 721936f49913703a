// The memory of a robot's machine, as text that can be unfolded.

import { element, row } from "./element.js";
import { texts } from "./texts.js";

/**
 * @import { MemoryDescription, NamedValue, QueueDescription, ValueDescription } from "./events"
 */

export class Memory {
    constructor() {
        // The parts that the user has folded or unfolded, by path.
        /** @type {Map<string, boolean>} */
        this.folds = new Map();
        /** @type {MemoryDescription["objects"]} */
        this.objects = {};
    }

    // Shows it in a part of the page, in which the focus stays where it is.
    /**
     * @param {HTMLElement} place
     * @param {MemoryDescription} held
     */
    show(place, held) {
        this.objects = held.objects;
        const focused = place.contains(document.activeElement) ? document.activeElement?.parentElement?.dataset.path : null;
        place.replaceChildren(...this.sections(held));
        if (focused) {
            [...place.querySelectorAll("details")].find((one) => one.dataset.path === focused)?.querySelector("summary")?.focus();
        }
    }

    // Shows the variables of a script alone: those of its calls, innermost first, and its globals.
    /**
     * @param {HTMLElement} place
     * @param {MemoryDescription} held
     */
    showScript(place, held) {
        this.objects = held.objects;
        place.replaceChildren(...this.frames(held), this.globals(held));
    }

    /**
     * @param {NamedValue[]} pairs
     * @param {string} path
     */
    named(pairs, path) {
        return pairs.filter(([name]) => !name.includes(" ")).map(([name, one]) => row(name, this.value(one, `${path}.${name}`)));
    }

    /** @param {MemoryDescription} held */
    globals(held) {
        return section(texts.globals, this.named(held.globals, "globals"));
    }

    /** @param {MemoryDescription} held */
    frames(held) {
        return held.frames.map((frame, index) => {
            const at = frame.source ? `${frame.source.file}:${frame.source.line}` : "";
            return section(`${texts.frame} ${frame.function} ${at}`, this.named(frame.locals, `frame ${index}`));
        });
    }

    /** @param {MemoryDescription} held */
    sections(held) {
        const parts = [this.globals(held), ...this.frames(held)];
        parts.push(section(texts.neighbors, held.neighbors.map((one) => row(texts.robot(one.id), texts.neighbor(one)))));
        if (held.swarms.length > 0) {
            parts.push(section(texts.swarms, held.swarms.map((one) => row(String(one.number), texts.swarm(one.is_member)))));
        }
        for (const one of held.stigmergies) {
            const rows = one.entries.map((entry, index) => row(this.value(entry.key, `stigmergy ${one.number} key ${index}`),
                this.value(entry.value, `stigmergy ${one.number} ${index}`), " ",
                element("small", {}, texts.entry(entry.owner, entry.clock))));
            parts.push(section(`${texts.stigmergy} ${one.number}`, rows));
        }
        if (held.queues) {
            const { inbox, outbox } = held.queues;
            parts.push(section(texts.queues, [
                row(texts.inbox, ...this.queue(inbox)), row(texts.outbox, ...this.queue(outbox)),
            ]));
        }
        return parts;
    }

    /**
     * @param {QueueDescription} queue
     * @returns {(string | Node)[]}
     */
    queue({ capacity, messages }) {
        const lines = messages.map((one) => element("span", { class: "message" }, texts.message(one), " ",
            ...("value" in one ? [this.value(one.value, "message")] : [])));
        return [texts.waiting(messages.length, capacity), ...lines];
    }

    // A value as text; tables unfold, each once on a path.
    /**
     * @param {ValueDescription} held
     * @param {string} path
     * @param {number[]} above the tables on the path
     * @returns {HTMLElement}
     */
    value(held, path, above = []) {
        if (held === null) {
            return element("span", { class: "nil" }, "nil");
        }
        if (typeof held === "number") {
            return element("span", { class: "number" }, String(held));
        }
        if (typeof held === "string") {
            return element("span", { class: "string" }, `"${held}"`);
        }
        if ("table" in held) {
            return this.table(held.table, path, above);
        }
        const [kind, name] = Object.entries(held)[0];
        /** @type {Record<string, string>} */
        const known = { unset: "nil", float: name, closure: "closure" };
        const text = known[kind] ?? `${kind.replace("_", " ")} ${name}`;
        return element("span", { class: "other" }, text);
    }

    /**
     * @param {number} id
     * @param {string} path
     * @param {number[]} above
     */
    table(id, path, above) {
        const object = this.objects[id];
        if (!object || !("entries" in object) || above.includes(id)) {
            return element("span", { class: "other" }, "{…}");
        }
        if (object.entries.length === 0) {
            return element("span", { class: "other" }, "{}");
        }
        const rows = object.entries.map(([key, held]) => {
            const name = typeof key === "string" ? `.${key}` : `[${JSON.stringify(key)}]`;
            return row(name, this.value(held, path + name, [...above, id]));
        });
        if (object.left_out > 0) {
            rows.push(row(texts.leftOut(object.left_out)));
        }
        const isOpen = this.folds.get(path) ?? above.length === 0;
        const details = element("details", isOpen ? { open: "" } : {},
            element("summary", {}, texts.table(object.entries.length)), element("dl", {}, ...rows));
        details.dataset.path = path;
        details.addEventListener("toggle", () => this.folds.set(path, details.open));
        return details;
    }
}

/**
 * @param {string} title
 * @param {Node[]} rows
 */
function section(title, rows) {
    const body = rows.length > 0 ? element("dl", {}, ...rows) : element("p", { class: "none" }, texts.none);
    return element("section", {}, element("h3", {}, title), body);
}
