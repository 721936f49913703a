// The panel of the world: links, lamps, the commands so far and the digest.

import { element, part, row, write } from "./element.js";
import { texts } from "./texts.js";

/**
 * @import { ConditionsEvent, DigestEvent, LightDescription, MediumDescription, PoseErrorDescription } from "./events"
 * @import { Ask, Place, World } from "./page"
 */

export class Ground {
    // `command(text)` gives a command, `ask(request)` asks for something else, `beginCut()` lets the user draw a line, `onSeed(seed)` starts
    // the run again with another seed.
    /**
     * @param {(text: string) => void} command
     * @param {Ask} ask
     * @param {() => void} beginCut
     * @param {(seed: number) => void} onSeed
     */
    constructor(command, ask, beginCut, onSeed) {
        this.onSeed = onSeed;
        this.command = command;
        this.ask = ask;
        this.beginCut = beginCut;
        this.ticksPerSecond = 1;
        // The first id and the number of robots of each group.
        /** @type {{ first: number, count: number }[]} */
        this.firstIds = [];
        this.lamps = element("section");
        this.poses = element("section");
        this.commands = element("section");
        this.undo = element("button");
        this.redo = element("button");
        // True while a change is deleted, whose button has the focus.
        this.isDeleting = false;
        this.digest = element("output", { id: "digest" });
        /** @type {LightDescription[]} */
        this.lights = [];
    }

    /** @param {World} world */
    begin(world) {
        this.ticksPerSecond = world.ticks_per_second;
        this.firstIds = world.groups.map(({ first_id: first, count }) => ({ first, count }));
        const facts = [
            row(texts.size, texts.sizeOf(...world.size)), row(texts.robots, String(world.groups.reduce((sum, { count }) => sum + count, 0))),
            row(texts.seed, this.seed(world)),
        ];
        this.lamps = element("section");
        this.poses = element("section");
        this.commands = element("section");
        this.undo = element("button", { type: "button", title: texts.undoHelp, onclick: () => this.ask("undo") }, texts.undo);
        this.redo = element("button", { type: "button", title: texts.redoHelp, onclick: () => this.ask("redo") }, texts.redo);
        const changes = element("section", { id: "changes" }, element("h3", {}, texts.commands),
            element("div", { class: "acts" }, this.undo, this.redo), this.commands);
        this.digest = element("output", { id: "digest" });
        const digest = element("section", {}, element("h3", {}, texts.digest),
            element("p", {},
                element("button", { type: "button", id: "ask-digest", title: texts.digestHelp, onclick: () => this.askDigest() }, texts.compute),
                " ", this.digest));
        const losses = element("section", {}, element("h3", {}, texts.losses), ...world.media.map((medium) => this.loss(medium)));
        part("ground").replaceChildren(element("h2", { class: "heard" }, texts.tabGround), element("dl", {}, ...facts), ...this.surroundings(world), ...this.fences(world), losses, this.partition(), this.lamps, this.poses, changes, digest);
        this.show({ ...world, can_undo: false, can_redo: false });
    }

    // The seed, and another one for a run from the beginning.
    /** @param {World} world */
    seed({ seed, scripts }) {
        if (!scripts) {
            return String(seed);
        }
        const field = element("input", { type: "number", min: 0, max: 4294967295, step: 1, required: "", value: String(seed), "aria-label": texts.seed });
        return element("form", {
            class: "place",
            onsubmit: (event) => {
                event.preventDefault();
                this.onSeed(Number(field.value));
            },
        }, field, element("button", { title: texts.runSeedHelp }, texts.run));
    }

    // The keys of the scenario that make the surroundings of a group unusual: wind, texture of the floor, latency of poses.
    /** @param {World} world */
    surroundings({ groups }) {
        return groups.filter(({ surroundings }) => surroundings.length > 0).map(({ name, surroundings }) =>
            element("section", { class: "surroundings" }, element("h3", {}, texts.surroundings(name ?? "")),
                element("dl", {}, ...surroundings.map(({ key, value, unit }) => row(key, `${value} ${unit}`)))));
    }

    // The boxes that robots do not leave in flight.
    /** @param {World} world */
    fences({ groups }) {
        return groups.flatMap(({ name, fence }) => {
            if (fence === null) {
                return [];
            }
            const [x, y] = fence.least.map((least, axis) => texts.between(least, fence.most[axis]));
            const height = texts.between(0, fence.height);
            return element("section", { class: "fence" }, element("h3", {}, texts.fence(name ?? "")),
                element("dl", {}, row("x", x), row("y", y), row(texts.height, height)));
        });
    }

    // The poses from outside that are wrong.
    /** @param {PoseErrorDescription[]} errors */
    showPoses(errors) {
        const lines = errors.map(({ robot, displaced: [x, y], seen_as: other }) => element("p", {}, texts.poseError(this.idOf(robot), x, y, other === null ? null : this.idOf(other))));
        this.poses.replaceChildren(...(lines.length > 0 ? [element("h3", {}, texts.poses), ...lines] : []));
    }

    // The id of a robot, by its number.
    /** @param {number} robot */
    idOf(robot) {
        let before = 0;
        for (const { first, count } of this.firstIds) {
            if (robot < before + count) {
                return first + robot - before;
            }
            before += count;
        }
        return robot;
    }

    // A slider for the share of frames that a medium loses.
    /** @param {MediumDescription} medium */
    loss({ name, loss }) {
        const shown = element("output", {}, loss ? texts.percent(loss[0]) : texts.ofModel);
        const slider = element("input", { type: "range", min: 0, max: 100, value: loss ? 100 * loss[0] : 0, "aria-label": texts.lossOf(name) });
        slider.addEventListener("input", () => {
            write(shown, texts.percent(Number(slider.value) / 100));
        });
        slider.addEventListener("change", () => this.command(`loss = ${Number(slider.value) / 100}\nmedium = "${name}"`));
        return element("label", { class: "loss" }, element("span", {}, texts.media[name] ?? name), slider, shown);
    }

    // Parts that receive nothing from each other: by a line through the world, or by ids.
    partition() {
        /** @type {(name: "drawLine" | "heal", onclick: () => void) => Node} */
        const button = (name, onclick) => element("button", { type: "button", title: texts[`${name}Help`], onclick }, texts[name]);
        const field = element("input", { type: "text", "aria-label": texts.partLabel, placeholder: texts.partExample });
        const ids = element("form", {
            class: "place",
            onsubmit: (event) => {
                event.preventDefault();
                this.cut(field.value.split(",").map((one) => one.trim()).filter((one) => one !== ""));
            },
        }, field, element("button", { title: texts.cutOffHelp }, texts.cutOff));
        return element("section", {}, element("h3", {}, texts.partition),
            element("div", { class: "acts" }, button("drawLine", this.beginCut), button("heal", () => this.command("heal = true"))), ids);
    }

    // The robots with these ids, groups of them or ranges receive only from each other.
    /** @param {(number | string)[]} robots */
    cut(robots) {
        const text = (/** @type {number | string} */ one) => (/^\d+$/.test(String(one)) ? String(one) : JSON.stringify(one));
        this.command(`partition = [[${robots.map(text).join(", ")}]]`);
    }

    // Lamps, poses and commands as they are now.
    /** @param {Omit<ConditionsEvent, "event">} conditions */
    show({ lights, pose_errors: errors, commands, can_undo: canUndo, can_redo: canRedo }) {
        this.undo.disabled = !canUndo;
        this.redo.disabled = !canRedo;
        this.lights = lights;
        this.showPoses(errors);
        const lamps = lights.map(({ at, brightness }, lamp) => {
            /** @type {(label: string, value: number, set: (value: number) => void) => Node} */
            const field = (label, value, set) => {
                const input = element("input", { type: "number", step: "any", value: Math.round(value), "aria-label": label });
                input.addEventListener("change", () => set(Number(input.value)));
                return input;
            };
            return element("p", { class: "lamp" },
                element("span", {}, texts.lamp(lamp + 1)),
                field(texts.lampX(lamp + 1), at[0], (x) => this.moveLamp(lamp, [x, at[1]])),
                field(texts.lampY(lamp + 1), at[1], (y) => this.moveLamp(lamp, [at[0], y])),
                field(texts.lampBrightness(lamp + 1), brightness, (value) => this.moveLamp(lamp, at, value)));
        });
        const none = element("p", { class: "none" }, texts.none);
        const head = element("p", { class: "lamp head" }, ...["", "x", "y", texts.brightness].map((text) => element("span", {}, text)));
        if (!this.lamps.contains(document.activeElement)) {
            this.lamps.replaceChildren(element("h3", {}, texts.lamps), ...(lamps.length > 0 ? [head, ...lamps] : [none]));
        }
        const lines = commands.map(({ tick, text }, number) => {
            const [time, line] = [(tick / this.ticksPerSecond).toFixed(1), text.replaceAll("\n", ", ")];
            return element("p", {}, element("time", {}, time), element("code", {}, line),
                element("button", { type: "button", class: "icon", title: texts.deleteChangeHelp, "aria-label": texts.deleteChange(line, time), onclick: () => this.delete(number) }, "×"));
        });
        this.commands.replaceChildren(...(lines.length > 0 ? lines : [none.cloneNode(true)]));
        if (this.isDeleting) {
            this.isDeleting = false;
            this.undo.focus();
        }
    }

    // Leaves a change out, as if it had never been made.
    /** @param {number} number in the list */
    delete(number) {
        this.isDeleting = true;
        this.ask({ delete_command: { number } });
    }

    /**
     * @param {number} moved
     * @param {Place} place
     * @param {number} [brightness] as before without one
     */
    moveLamp(moved, place, brightness) {
        const lights = this.lights.map((light, lamp) => lamp === moved ? { at: place, brightness: brightness ?? light.brightness } : light);
        /** @type {(light: LightDescription) => string} */
        const text = ({ at: [x, y], brightness: bright }) => `{ at = [${x.toFixed(1)}, ${y.toFixed(1)}], brightness = ${bright} }`;
        this.command(`light = [${lights.map(text).join(", ")}]`);
    }

    // The digest of an earlier tick goes, so that the answer is seen to come.
    askDigest() {
        write(this.digest, "");
        this.ask("digest");
    }

    /** @param {DigestEvent} event */
    showDigest({ tick, digest }) {
        write(this.digest, texts.digestAt(digest, tick / this.ticksPerSecond));
    }
}
