// The tab About: the texts of the scenario and its scripts, the robots, the meanings of colors, and commands to try.

import { element, part, write } from "./element.js";
import { icon, led } from "./glyph.js";
import { language, texts, translated } from "./texts.js";

/**
 * @import { AssignmentDescription, LightDescription, Paragraph, ScriptAbout } from "./events"
 * @import { Group, World } from "./page"
 */

export class About {
    // `command(text)` gives a command.
    /** @param {(text: string) => void} command */
    constructor(command) {
        this.command = command;
        /** @type {World | null} */
        this.world = null;
        this.lights = element("section");
    }

    /** @param {World} world */
    begin(world) {
        this.world = world;
        const { about } = world;
        const task = taskOf(world.assignment);
        const title = task?.title ?? titleOf(world.scripts?.scenario ?? "");
        const paragraphs = task?.text ? task.text.split(/\n\s*\n/) : paragraphsOf(about?.text ?? []);
        const scripts = about?.scripts ?? [];
        const tries = translated(about?.proposals ?? []).map(({ label, command }) =>
            element("button", { type: "button", title: command, onclick: () => this.command(command) }, label));
        this.lights = element("section");
        const sections = [
            this.section(texts.robots, element("ul", { class: "kinds" }, ...world.groups.map((group) => kind(group)))),
            ...scripts.filter(({ leds }) => leds.length > 0).map((script) => this.section(texts.colorsOf(script.name), meanings(script))),
            this.lights,
            ...(tries.length > 0 ? [this.section(texts.tries, element("div", { class: "tries" }, ...tries))] : []),
            ...scripts.filter(({ text }) => text.length > 0).map(({ name, text }) => this.section(texts.scriptOf(name), ...paragraphsOf(text).map(paragraph))),
        ];
        part("about").replaceChildren(...(title ? [element("h2", {}, title)] : []), ...paragraphs.map(paragraph), ...sections);
        this.show(world.lights);
    }

    // Robots run other texts now.
    /** @param {ScriptAbout[]} scripts */
    ran(scripts) {
        if (this.world?.about) {
            this.world.about.scripts = scripts;
            this.begin(this.world);
        }
    }

    /** @param {LightDescription[]} lights */
    show(lights) {
        if (this.world) {
            this.world.lights = lights;
        }
        this.lights.replaceChildren(...(lights.length === 0 ? [] : [element("h3", {}, texts.lights),
            ...lights.map(({ at: [x, y], brightness }) => element("p", {}, texts.lightAt(Math.round(x), Math.round(y), brightness)))]));
    }

    /**
     * @param {string} title
     * @param {Node[]} content
     */
    section(title, ...content) {
        return element("section", {}, element("h3", {}, title), ...content);
    }
}

// The task in the language of the page, or else in that of the scenario.
/** @param {AssignmentDescription | null} assignment */
export function taskOf(assignment) {
    return assignment && (assignment.translations[language] ?? assignment);
}

// The meaning of a color in a script; "" if the script has none.
/**
 * @param {World} world
 * @param {Group} group
 * @param {number} color
 */
export function meaningOf(world, group, color) {
    const script = world.about?.scripts.find(({ name }) => name === group.script);
    return translated(script?.leds ?? []).find((one) => one.color === color)?.meaning ?? "";
}

/** @param {Paragraph[]} all */
function paragraphsOf(all) {
    return translated(all).map(({ text }) => text);
}

/** @param {string} text */
function paragraph(text) {
    const made = element("p");
    // Code in a text stands between backticks.
    text.split("`").forEach((piece, number) => made.append(number % 2 === 1 ? element("code", {}, piece) : element("span", {}, piece)));
    return made;
}

/** @param {Group} group */
function kind({ name, robot, script, glyph, count, first_id: first, link }) {
    const facts = element("span");
    write(facts, [
        texts.countOf(count, robot ?? ""), texts.idsOf(first, first + count - 1),
        ...(script ? [texts.runs(script)] : []), ...(link ? [texts.rangeOf(link)] : []),
    ].join(", "));
    return element("li", { title: name ?? "" }, icon(glyph), facts);
}

/** @param {ScriptAbout} script */
function meanings({ leds }) {
    return element("ul", { class: "leds" }, ...translated(leds).map(({ color, meaning }) => element("li", {}, led(color), texts.ledOf(color, meaning))));
}

// The name of a file as a title.
/** @param {string} file */
function titleOf(file) {
    const words = (file.split("/").pop() ?? "").replace(/\.toml$/, "").replaceAll("_", " ");
    return words.charAt(0).toUpperCase() + words.slice(1);
}
