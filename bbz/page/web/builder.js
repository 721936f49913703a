// The mode in which a world is built by hand: each change is one of the scenario's text, and starts the run from the beginning.

import { BuildHand } from "./build-hand.js";
import { BuildPanel } from "./build-panel.js";
import { inside, part, write } from "./element.js";
import { texts } from "./texts.js";
import { centerOf, formOf, freePlace, GRID, movedBy, turnedBy, valuesOf } from "./things.js";

// The sizes in mm of things that are added by a click or a key.
const WALL = 200;
const BOX = 100;
const RADIUS = 50;

/**
 * @import { BuiltEvent, Thing, ThingKind, ThingValues, WorldEdit } from "./events"
 * @import { Ask, Place, World } from "./page"
 * @import { Tool } from "./build-panel.js"
 * @import { Editor } from "./editor.js"
 * @import { NoticeKind } from "./notice.js"
 * @import { View } from "./view.js"
 */

/**
 * A change, by the texts before and after it.
 * @typedef {{ before: string, after: string }} Built
 */

export class Builder {
    // `say(text)` shows an answer, `announce(text)` says it to a screen reader, `onEnter()` when the mode begins.
    /**
     * @param {View} view
     * @param {Editor} editor
     * @param {Ask} ask
     * @param {{ say: (text: string, kind?: NoticeKind) => void, announce: (text: string) => void, onEnter: () => void, isAtStart: () => boolean }} actions
     */
    constructor(view, editor, ask, actions) {
        this.view = view;
        this.editor = editor;
        this.ask = ask;
        this.actions = actions;
        this.isOn = false;
        // The run that starts again for this mode, and what is said then.
        /** @type {string | null} */
        this.entering = null;
        /** @type {Tool} */
        this.tool = "choose";
        /** @type {Thing | null} */
        this.chosen = null;
        // What a paste adds.
        /** @type {{ kind: ThingKind, thing: Thing | null, values: ThingValues, group: number } | null} */
        this.copied = null;
        // A change that the session makes, and the actions that wait for it and for the places of the robots after it.
        this.isBusy = false;
        this.isAnswered = false;
        // A thing was changed; its place comes with the next sample.
        this.isBuilt = false;
        /** @type {(() => void)[]} */
        this.waiting = [];
        /** @type {Built[]} */
        this.past = [];
        /** @type {Built[]} */
        this.future = [];
        // The undo or redo that is on its way.
        /** @type {"undo" | "redo" | null} */
        this.moving = null;
        this.panel = new BuildPanel(this);
        this.hand = new BuildHand(this);
        part("build-mode").onclick = () => this.toggle();
        part("build").addEventListener("keydown", (event) => !(event.target instanceof HTMLInputElement) && this.hand.key(event) && event.preventDefault());
    }

    toggle() {
        this.isOn ? this.leave() : this.enter();
    }

    // The run starts from the beginning, with the texts that are shown: what is seen is then what the text says.
    enter() {
        const { world } = this.view;
        if (!world?.scripts || this.entering !== null) {
            return;
        }
        this.entering = this.actions.isAtStart() ? "" : texts.buildStarts;
        this.editor.holdScenario();
        this.editor.run();
    }

    // Returns true if a run that began is for this mode, and does not play.
    began() {
        if (this.entering !== null) {
            // The mode begins with the places of the robots.
            this.isAnswered = true;
            return true;
        }
        if (this.moving) {
            const [from, to] = this.moving === "undo" ? [this.past, this.future] : [this.future, this.past];
            to.push(.../** @type {Built[]} */ ([from.pop()]));
            this.actions.announce(this.moving === "undo" ? texts.undone : texts.redone);
            this.moving = null;
            this.chosen = null;
        }
        this.isAnswered = this.isBusy;
        return this.isOn;
    }

    /** @param {string} said */
    entered(said) {
        this.entering = null;
        this.set(true);
        part("canvas").focus();
        this.actions.onEnter();
        this.actions.announce(texts.buildOn);
        said && this.actions.say(said, "progress");
    }

    leave() {
        this.set(false);
        this.actions.announce(texts.buildOff);
        part("build-mode").focus();
    }

    // The run goes on, which ends the mode.
    ran() {
        if (this.isOn && !this.isBusy) {
            this.set(false);
        }
    }

    /** @param {boolean} isOn */
    set(isOn) {
        this.isOn = isOn;
        this.tool = "choose";
        this.chosen = null;
        this.hand.isOn = isOn;
        this.hand.drag = null;
        this.hand.drop();
        [this.isBusy, this.isAnswered, this.isBuilt, this.waiting] = [false, false, false, []];
        this.view.overlay = isOn ? this.hand : null;
        document.body.classList.toggle("building", isOn);
        part("build").hidden = !isOn;
        this.showHint();
        this.panel.show();
        this.view.changed();
    }

    showHint() {
        const { world } = this.view;
        write(inside(part("hint"), "[data-text]"), world?.watched ? texts.hintWatched : this.isOn ? texts.hintBuild[this.tool] : texts.hint);
    }

    /** @param {World} world */
    begin(world) {
        part("build-mode").hidden = !world.scripts;
        if (this.isOn && !this.isBusy) {
            // Another scenario, or another page's run.
            this.set(false);
        }
        this.showHint();
    }

    // The places of a new run have come.
    sampled() {
        if (!this.isAnswered) {
            return;
        }
        const { entering } = this;
        [this.isBusy, this.isAnswered] = [false, false];
        if (entering !== null) {
            this.entered(entering);
            return;
        }
        this.hand.settle();
        if (this.chosen && !valuesOf(this.view, this.chosen)) {
            this.chosen = null;
        }
        if (this.isBuilt) {
            this.isBuilt = false;
            this.actions.announce(this.chosen ? this.nameOf(this.chosen) : texts.deleted);
        }
        this.panel.show();
        this.next();
    }

    next() {
        while (!this.isBusy && this.waiting.length > 0) {
            this.waiting.shift()?.();
        }
    }

    // Acts now, or after the change that is on its way.
    /** @param {() => void} action */
    act(action) {
        this.waiting.push(action);
        this.next();
    }

    /** @param {WorldEdit} edit */
    send(edit) {
        this.isBusy = true;
        this.ask({ build: { edit, texts: this.editor.texts(), keep_changes: part("keep-changes").checked } });
    }

    /** @param {BuiltEvent} event */
    built({ before, text, thing }) {
        this.editor.takeScenario(text);
        this.past.push({ before, after: text });
        this.future = [];
        [this.isAnswered, this.isBuilt] = [true, true];
        if (!thing) {
            // The thing that is dragged meanwhile may have another number.
            this.hand.drag = null;
        }
        if (!this.hand.drag?.thing) {
            this.chosen = thing;
        }
    }

    refused() {
        this.entering = null;
        this.moving = null;
        if (this.isBusy) {
            [this.isBusy, this.isAnswered] = [false, false];
            this.hand.settle();
            this.panel.show();
            this.next();
        }
    }

    // Undoes the last change, or makes the next one again. What was typed since is not lost.
    /** @param {"undo" | "redo"} way */
    move(way) {
        const last = way === "undo" ? this.past.at(-1) : this.future.at(-1);
        if (!last) {
            this.actions.say(way === "undo" ? texts.noUndo : texts.noRedo);
            return;
        }
        const [from, to] = way === "undo" ? [last.after, last.before] : [last.before, last.after];
        if (this.editor.scenarioText() !== from) {
            [this.past, this.future] = [[], []];
            this.actions.say(texts.typedSince);
            this.panel.show();
            return;
        }
        [this.isBusy, this.moving] = [true, way];
        this.editor.runScenario(() => to);
    }

    /** @param {Tool} tool */
    take(tool) {
        this.tool = tool;
        this.showHint();
        this.panel.show();
        this.view.canvas.style.cursor = tool === "choose" ? "" : "crosshair";
    }

    /** @param {Thing | null} thing */
    choose(thing) {
        this.chosen = thing;
        this.panel.show();
        this.view.changed();
        if (thing) {
            this.actions.announce(this.nameOf(thing));
        }
    }

    // The values of the chosen thing.
    get values() {
        return this.chosen && valuesOf(this.view, this.chosen);
    }

    /** @param {Thing} thing */
    nameOf({ kind, number }) {
        const values = valuesOf(this.view, { kind, number });
        const form = kind === "obstacle" ? formOf(values ?? {}) : kind;
        return texts.thing(form, kind === "robot" ? this.view.robots.ids[number] : number + 1);
    }

    /** @param {ThingValues} values */
    change(values, thing = this.chosen) {
        if (thing) {
            this.send({ change: { thing, values: rounded(values) } });
        }
    }

    // Moves the chosen thing by some mm.
    /** @param {Place} way */
    nudge(way) {
        const { values } = this;
        if (values) {
            this.change(movedBy(values, way));
        }
    }

    /** @param {number} degrees */
    turn(degrees) {
        const { values } = this;
        const turned = values && turnedBy(values, degrees);
        if (turned) {
            this.change(turned);
        } else if (values) {
            this.actions.say(texts.noDirection);
        }
    }

    delete() {
        const { chosen, copied } = this;
        if (chosen) {
            // A copy of it stays possible; the numbers of those after it are one less.
            if (copied?.thing && copied.kind === chosen.kind && copied.thing.number >= chosen.number) {
                copied.thing = copied.thing.number === chosen.number ? null : { ...copied.thing, number: copied.thing.number - 1 };
            }
            this.send({ delete: { thing: chosen } });
        }
    }

    copy() {
        const { chosen, values } = this;
        if (chosen && values) {
            this.copied = { kind: chosen.kind, thing: chosen, values, group: this.groupOf(chosen) };
            this.actions.announce(texts.copied(this.nameOf(chosen)));
        }
    }

    paste() {
        const { copied, view } = this;
        if (!copied) {
            return;
        }
        const { kind, thing, values, group } = copied;
        const [x, y] = centerOf(values);
        const radius = kind === "robot" ? view.world?.groups[group].radius ?? 0 : 0;
        const reach = values.size ? Math.hypot(...values.size) / 2 : values.radius ?? 0;
        const away = Math.max(2 * GRID, Math.round(reach / GRID) * GRID);
        const at = kind === "robot" ? freePlace(view, [x, y], radius) : this.inside([x + away, y - away], 0);
        const moved = movedBy(values, [at[0] - x, at[1] - y]);
        // Further copies lie beside this one.
        copied.values = { ...values, ...moved };
        if (thing) {
            this.send({ copy: { thing, values: rounded(kind === "robot" ? { ...values, ...moved } : moved) } });
        } else {
            this.send({ add: { kind, ...(kind === "robot" ? { group } : {}), values: rounded(copied.values) } });
        }
    }

    duplicate() {
        this.copy();
        this.paste();
    }

    // The number of the group of a robot, or of the one to which robots are added.
    /** @param {Thing} thing */
    groupOf({ kind, number }) {
        const groups = this.view.world?.groups ?? [];
        return kind === "robot" ? groups.findIndex(({ first, count }) => number < first + count) : 0;
    }

    // Adds what the tool makes: at a place, or between two.
    /**
     * @param {Place} from
     * @param {Place} [to]
     */
    add(from, to) {
        // The tool may be another one when the change before is made.
        const made = this.made(from, to);
        if (made) {
            const { kind, values } = made;
            const group = kind === "robot" ? { group: this.panel.group } : {};
            this.act(() => this.send({ add: { kind, ...group, values: rounded(values) } }));
        }
    }

    /**
     * @param {Place} from
     * @param {Place} [to]
     * @returns {{ kind: ThingKind, values: ThingValues } | null}
     */
    made([x, y], to) {
        const box = () => {
            const size = to ? [Math.abs(to[0] - x), Math.abs(to[1] - y)] : [BOX, BOX];
            const at = to ? [(x + to[0]) / 2, (y + to[1]) / 2] : [x, y];
            return { at: /** @type {Place} */ (at), size: /** @type {[number, number]} */ (size.map((side) => Math.max(1, side))) };
        };
        // A drag begins at the center.
        const disc = () => ({ at: /** @type {Place} */ ([x, y]), radius: to ? Math.max(1, Math.hypot(to[0] - x, to[1] - y)) : RADIUS });
        switch (this.tool) {
            case "robot": return { kind: "robot", values: { at: to ?? [x, y] } };
            case "lamp": return { kind: "lamp", values: { at: to ?? [x, y], brightness: 1023 } };
            case "wall": return { kind: "obstacle", values: to ? { from: [x, y], to } : { from: [x - WALL / 2, y], to: [x + WALL / 2, y] } };
            case "box": return { kind: "obstacle", values: box() };
            case "disc": return { kind: "obstacle", values: disc() };
            case "puck": return { kind: "movable", values: disc() };
            case "paint": return { kind: "patch", values: { ...box(), brightness: 0 } };
            default: return null;
        }
    }

    // A place in the middle of the picture: for a robot, a free one near it.
    middle() {
        const { camera, world } = this.view;
        const at = this.inside([this.snap(camera.x), this.snap(camera.y)], 0);
        return this.tool === "robot" ? freePlace(this.view, at, world?.groups[this.panel.group].radius ?? 0) : at;
    }

    // The nearest place in the world.
    /**
     * @param {Place} place
     * @param {number} radius
     * @returns {Place}
     */
    inside([x, y], radius) {
        const [right, up] = (this.view.world?.size ?? [0, 0]).map((side) => Math.max(0, side / 2 - radius));
        return [Math.max(-right, Math.min(right, x)), Math.max(-up, Math.min(up, y))];
    }

    /** @param {number} length */
    snap(length, step = GRID) {
        return Math.round(length / step) * step;
    }

    // A place for a thing: on the grid without Shift.
    /**
     * @param {Place} place
     * @param {boolean} isExact
     * @returns {Place}
     */
    placed([x, y], isExact) {
        return this.inside(isExact ? [Math.round(x), Math.round(y)] : [this.snap(x), this.snap(y)], 0);
    }
}

// Values as the text has them: two decimals.
/**
 * @param {ThingValues} values
 * @returns {ThingValues}
 */
function rounded(values) {
    /** @type {(value: number) => number} */
    const round = (value) => Math.round(value * 100) / 100;
    return Object.fromEntries(Object.entries(values).map(([key, value]) => [key, Array.isArray(value) ? value.map(round) : round(value)]));
}
