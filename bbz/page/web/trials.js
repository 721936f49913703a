// The assignment, the hand-in, and trials next to the run.

import { taskOf } from "./about.js";
import { element, option, part, save, saveTable, write } from "./element.js";
import { quantile } from "./scale.js";
import { texts } from "./texts.js";

// Width and height of the picture, and the room for its numbers.
const [WIDTH, HEIGHT, LEFT, BOTTOM] = [320, 150, 44, 18];

/**
 * @import { AssignmentDescription, QuantityNames, ResultEvent, TrialEvent, TrialsEvent } from "./events"
 * @import { Ask, Texts, World } from "./page"
 */

/**
 * The trials with one value: their number, those that succeeded, and extremes and quartiles of the number that they count as.
 * @typedef {{ value: string | null, trials: number, successes: number, five: number[] | null }} Row
 */

export class Trials {
    // `textsOf()` are the texts that are shown, by their names.
    /**
     * @param {Ask} ask
     * @param {() => Texts} textsOf
     */
    constructor(ask, textsOf) {
        this.ask = ask;
        this.textsOf = textsOf;
        /** @type {World | null} */
        this.world = null;
        this.vary = element("input");
        /** @type {HTMLFormElement | null} */
        this.form = null;
        this.progress = element("progress");
        this.result = element("div");
        this.handed = element("p");
        this.name = "";
        /** @type {TrialEvent[]} */
        this.done = [];
        // The number of the expectation that trials count by; `null`: a quantity.
        /** @type {number | null} */
        this.measured = null;
        /** @type {string | null} */
        this.key = null;
    }

    /** @param {World} world */
    begin(world) {
        // The values of the form stay when the run starts again, and so do the trials of the same world.
        const before = this.form && Object.fromEntries(new FormData(this.form));
        const isKept = sameTrials(this.world, world);
        this.world = world;
        this.showAssignment(world.assignment);
        part("trials").hidden = !world.scripts;
        this.vary = element("input", { type: "text", name: "vary", list: "keys-of-trials", placeholder: texts.varyExample });
        const keys = element("datalist", { id: "keys-of-trials" }, ...this.keys(world).map((key) => option(key)));
        const form = element("form", {
            class: "trials",
            onsubmit: (event) => {
                event.preventDefault();
                this.start(form);
            },
        },
            label(texts.vary, this.vary), keys,
            label(texts.values, element("input", { type: "text", name: "values", placeholder: texts.valuesExample })),
            label(texts.seeds, element("input", { type: "number", name: "seeds", min: 1, max: 1000, value: 5, required: "" })),
            label(texts.measure, this.measures(world)),
            element("div", { class: "acts" },
                element("button", { class: "main", title: texts.sweepHelp }, texts.start),
                element("button", { type: "button", onclick: () => this.ask("stop_trials") }, texts.stopTrials)));
        for (const [name, value] of Object.entries(before ?? {})) {
            const field = /** @type {HTMLInputElement | HTMLSelectElement} */ (form.elements.namedItem(name));
            field.value = String(value) || field.value;
            if (field instanceof HTMLSelectElement && field.selectedIndex < 0) {
                // The edited scenario has not got that quantity.
                field.selectedIndex = 0;
            }
        }
        this.form = form;
        this.progress = element("progress", { max: 100, value: 0, hidden: "" });
        if (!isKept) {
            this.result = element("div");
            this.done = [];
        }
        part("trials").replaceChildren(element("h3", {}, texts.tryOut), this.form, this.progress, this.result);
    }

    /** @param {AssignmentDescription | null} assignment */
    showAssignment(assignment) {
        const task = taskOf(assignment);
        part("assignment").hidden = !task;
        if (!task) {
            return;
        }
        const keep = () => {
            this.name = name.value;
        };
        const name = element("input", { type: "text", "aria-label": texts.by, placeholder: texts.by, autocomplete: "name", required: "", oninput: keep });
        name.value = this.name;
        const form = element("form", {
            class: "place",
            onsubmit: (event) => {
                event.preventDefault();
                write(this.handed, texts.trying);
                this.ask({ hand_in: { by: name.value, texts: this.textsOf() } });
            },
        }, name, element("button", { class: "main", title: texts.handInHelp }, texts.handIn));
        this.handed = element("p", { role: "status" });
        // Lines of a paragraph may be as long as they are.
        const paragraphs = task.text.split(/\n\s*\n/).filter((one) => one.trim() !== "");
        part("assignment").replaceChildren(element("h2", {}, task.title),
            ...paragraphs.map((one) => element("p", {}, ...one.split("`").map((piece, at) => (at % 2 === 1 ? element("code", {}, piece) : piece)))),
            form, this.handed);
    }

    // Keys that are often varied, first those that the scripts name.
    /** @param {World} world */
    keys({ controls, media }) {
        const globals = (controls ?? []).map(({ name }) => `global.${name}`);
        return [...globals, ...media.map(({ name }) => `medium.${name}.loss`), "robots.0.count"];
    }

    /** @param {World} world */
    measures({ expectations, quantities }) {
        /** @type {[string, HTMLOptionElement[]]} */
        const since = ["since", expectations.map(({ name, text, line }, number) => {
            // Two expectations may differ in their tolerance alone.
            const isUnique = expectations.filter((other) => (other.name ?? other.text) === (name ?? text)).length === 1;
            return option(`${name ?? text}${isUnique ? "" : ` (${texts.line(line)})`}`, `since ${number}`);
        })];
        const ofQuantities = Object.entries(quantities).map(([kind, names]) => {
            const own = kind === "plot" ? names : names.filter((name) => !quantities.plot.includes(name));
            return /** @type {[string, HTMLOptionElement[]]} */ ([kind, own.map((name) => option(name, `end ${name}`))]);
        });
        // The scenario names first what it is about; the column of successes has the expectations already.
        const groups = [...ofQuantities.filter(([kind]) => kind === "plot"), since, ...ofQuantities.filter(([kind]) => kind !== "plot")];
        return element("select", { name: "measure" }, ...groups.filter(([, options]) => options.length > 0)
            .map(([kind, options]) => element("optgroup", { label: /** @type {Record<string, string>} */ (texts.quantities)[kind] ?? texts.since }, ...options)));
    }

    /** @param {HTMLFormElement} form */
    start(form) {
        const data = new FormData(form);
        const [vary, values, seeds, measure] = ["vary", "values", "seeds", "measure"].map((name) => String(data.get(name) ?? ""));
        const [kind, ...rest] = measure.split(" ");
        this.measured = kind === "since" ? Number(rest[0]) : null;
        this.done = [];
        this.key = vary.trim() || null;
        this.ask({ sweep: {
            key: this.key,
            // Commas in brackets and quotes are part of a value.
            values: values.match(/(?:\[[^\]]*\]|"[^"]*"|[^,])+/g)?.map((one) => one.trim()).filter((one) => one !== "") ?? [],
            seeds: Number(seeds),
            quantity: kind === "end" ? rest.join(" ") : null,
        } });
    }

    /** @param {TrialsEvent} event */
    advanced({ percent }) {
        this.progress.hidden = percent === 100;
        this.progress.value = percent;
    }

    // A trial is over.
    /** @param {TrialEvent} trial */
    take(trial) {
        this.done.push(trial);
        const values = [...new Set(this.done.map(({ value }) => value))];
        const rows = values.map((value) => this.summary(value));
        const head = element("tr", {}, ...texts.sweepHead.map((text) => element("th", { scope: "col" }, text)));
        const cells = rows.map(({ value, trials, successes, five }) => element("tr", {},
            ...[value ?? texts.chance, trials, successes, five ? texts.number(five[2]) : texts.none, five ? texts.quartiles(five[1], five[3]) : ""]
                .map((text) => element("td", {}, String(text)))));
        this.result.replaceChildren(picture(rows), element("table", {}, element("thead", {}, head), element("tbody", {}, ...cells)),
            element("button", { type: "button", onclick: () => this.saveTable() }, texts.saveTable));
        if (this.done.length === 1) {
            this.result.scrollIntoView({ block: "nearest" });
        }
    }

    // The number that a trial counts as: the mean of its robots, or the time of an expectation.
    /** @param {TrialEvent} trial */
    number({ since, numbers }) {
        if (this.measured !== null) {
            return since[this.measured];
        }
        const known = (numbers ?? []).filter((one) => one !== null);
        return known.length > 0 ? known.reduce((sum, one) => sum + one, 0) / known.length : null;
    }

    /**
     * @param {string | null} value
     * @returns {Row}
     */
    summary(value) {
        const trials = this.done.filter((one) => one.value === value);
        const numbers = trials.map((one) => this.number(one)).filter((one) => one !== null).sort((one, other) => one - other);
        const five = numbers.length > 0 ? [0, 0.25, 0.5, 0.75, 1].map((share) => quantile(numbers, share)) : null;
        return { value, trials: trials.length, successes: trials.filter(({ success }) => success).length, five };
    }

    saveTable() {
        const quoted = (/** @type {string} */ text) => `"${text.replaceAll("\"", "\"\"")}"`;
        const expectations = (this.world?.expectations ?? []).map(({ name, text }) => name ?? text);
        const head = [this.key ?? "value", "seed", "success", ...expectations.map((one) => `since ${one}`), "number"];
        /** @type {(string | number | boolean)[][]} */
        const rows = this.done.map((one) => [one.value ?? "", one.seed, one.success, ...one.since.map((since) => since ?? ""), this.number(one) ?? ""]);
        const lines = [head, ...rows].map((row) => row.map((cell) => (typeof cell === "string" && cell !== "" ? quoted(cell) : cell)).join(","));
        saveTable(`${lines.join("\n")}\n`, texts.tableAs);
    }

    /** @param {string} reason */
    refused(reason) {
        if (this.handed.textContent === texts.trying) {
            write(this.handed, reason);
        }
    }

    /** @param {ResultEvent} event */
    handIn(event) {
        save(new Blob([event.text], { type: "application/json" }), event.name);
        write(this.handed, texts.handedIn(event));
    }
}

// Trials of both worlds are compared with the same expectations.
/**
 * @param {World | null} one
 * @param {World} other
 */
function sameTrials(one, other) {
    const expected = (/** @type {World | null} */ world) => JSON.stringify(world?.expectations.map(({ name, text }) => [name, text]));
    return one !== null && one.scripts?.file === other.scripts?.file && expected(one) === expected(other);
}

/**
 * @param {string} text
 * @param {HTMLElement} field
 */
function label(text, field) {
    return element("label", {}, element("span", {}, text), field);
}

// Medians as a line, quartiles as an area, extremes as thin lines; places on the x axis are the values, if all are numbers.
/** @param {Row[]} rows */
function picture(rows) {
    const known = rows.flatMap(({ value, five }) => (five ? [{ value, five }] : []));
    /** @type {(name: string, attributes: Record<string, string | number>, ...children: (string | Node)[]) => Node} */
    const drawn = (name, attributes, ...children) => {
        const made = document.createElementNS("http://www.w3.org/2000/svg", name);
        Object.entries(attributes).forEach(([key, value]) => made.setAttribute(key, String(value)));
        made.append(...children);
        return made;
    };
    if (known.length === 0) {
        return "";
    }
    const numbers = known.map(({ value }) => Number(value));
    const isNumeric = known.length > 1 && known.every(({ value }) => value !== null) && numbers.every(Number.isFinite);
    const places = isNumeric ? numbers : known.map((_, at) => at);
    const [left, right] = [Math.min(...places), Math.max(...places)];
    const [low, high] = [Math.min(...known.map(({ five }) => five[0])), Math.max(...known.map(({ five }) => five[4]))];
    const x = (/** @type {number} */ place) => LEFT + 8 + ((place - left) / (right - left || 1)) * (WIDTH - LEFT - 24);
    const y = (/** @type {number} */ number) => 8 + (1 - (number - low) / (high - low || 1)) * (HEIGHT - BOTTOM - 16);
    const points = known.map(({ value, five }, at) => ({ value, x: x(places[at]), y: five.map(y) })).sort((one, other) => one.x - other.x);
    const line = (/** @type {number[][]} */ list) => list.map((point) => point.map((one) => one.toFixed(1)).join(",")).join(" ");
    /** @type {(text: string, at: Record<string, string | number>) => Node} */
    const name = (text, at) => drawn("text", at, text);
    return drawn("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": texts.sweepLabel, class: "sweep" },
        drawn("polygon", { points: line([...points.map((one) => [one.x, one.y[1]]), ...points.toReversed().map((one) => [one.x, one.y[3]])]) }),
        ...points.map((one) => drawn("line", { x1: one.x, x2: one.x, y1: one.y[0], y2: one.y[4] })),
        drawn("polyline", { points: line(points.map((one) => [one.x, one.y[2]])) }),
        ...points.map((one) => drawn("circle", { cx: one.x, cy: one.y[2], r: 3 })),
        name(texts.number(high), { x: LEFT - 4, y: y(high) + 4, "text-anchor": "end" }),
        ...(high > low ? [name(texts.number(low), { x: LEFT - 4, y: y(low) + 4, "text-anchor": "end" })] : []),
        ...points.map((one) => name(one.value ?? texts.chance, { x: one.x, y: HEIGHT - 4, "text-anchor": "middle" })));
}
