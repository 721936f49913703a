// The actions of the mouse and the keys in a world that is built.

import { drawThing } from "./build-picture.js";
import { TOOLS } from "./build-panel.js";
import { centerOf, GRID, handleAt, handlesOf, movedBy, thingAt, TURN, valuesOf } from "./things.js";

// mm of an arrow key with Shift, and the length of a drag that draws nothing.
const FINE = 1;
const LEAST = 5;

/**
 * @import { Thing, ThingKind, ThingValues } from "./events"
 * @import { Place } from "./page"
 * @import { Builder } from "./builder.js"
 * @import { Handle } from "./things.js"
 */

/**
 * A thing that is dragged, by a handle or as a whole, or drawn: from the place at which that began.
 * @typedef {{ start: Place, handle: Handle | null, thing: Thing | null, hasMoved: boolean }} Drag
 */

export class BuildHand {
    /** @param {Builder} builder */
    constructor(builder) {
        this.builder = builder;
        this.view = builder.view;
        this.isOn = false;
        /** @type {Drag | null} */
        this.drag = null;
        // The values that the dragged or drawn thing will have.
        /** @type {{ kind: ThingKind, number: number | null, values: ThingValues } | null} */
        this.ghost = null;
    }

    // The picture is that of the session again.
    drop() {
        [this.ghost, this.view.dragged] = [null, null];
        this.view.changed();
    }

    // A change is made or refused. What is drawn meanwhile goes on.
    settle() {
        if (!this.drag) {
            this.drop();
        }
    }

    // A button is pressed in the world. Returns false if it moves the view.
    /**
     * @param {Place} at
     * @param {PointerEvent} event
     */
    press(at, event) {
        const { builder } = this;
        if (builder.tool !== "choose") {
            this.drag = { start: builder.placed(at, event.shiftKey), handle: null, thing: null, hasMoved: false };
            return true;
        }
        const handle = builder.chosen && builder.values ? handleAt(this.view, this.handles(event.shiftKey), at) : null;
        const thing = handle ? builder.chosen : thingAt(this.view, at);
        // Keys that wait for a change were pressed for the thing that was chosen then.
        builder.act(() => thing !== builder.chosen && builder.choose(thing));
        this.drag = thing && { start: at, handle, thing, hasMoved: false };
        return thing !== null;
    }

    handles(isExact = false) {
        const { view, builder } = this;
        const { chosen, values } = builder;
        const snap = (/** @type {number} */ length) => builder.snap(length, isExact ? FINE : GRID);
        return chosen && values ? handlesOf(view, chosen, values, snap) : [];
    }

    /**
     * @param {Place} at
     * @param {PointerEvent} event
     */
    pull(at, event) {
        const { builder, drag, view } = this;
        if (!drag) {
            return;
        }
        drag.hasMoved = true;
        if (!drag.thing) {
            const made = builder.made(drag.start, builder.placed(at, event.shiftKey));
            this.ghost = made && { ...made, number: null };
        } else {
            const values = valuesOf(view, drag.thing);
            if (values) {
                this.ghost = { ...drag.thing, values: { ...values, ...this.pulled(drag, values, at, event.shiftKey) } };
            }
        }
        const { ghost } = this;
        view.dragged = ghost?.number != null && (ghost.kind === "robot" || ghost.kind === "lamp")
            ? { robot: ghost.kind === "robot" ? ghost.number : null, lamp: ghost.kind === "lamp" ? ghost.number : null, at: centerOf(ghost.values) } : null;
        view.changed();
    }

    // The values that a drag changes.
    /**
     * @param {Drag} drag
     * @param {ThingValues} values
     * @param {Place} at
     * @param {boolean} isExact
     */
    pulled({ start, handle, thing }, values, at, isExact) {
        const { builder } = this;
        if (handle) {
            const pulled = handle.values(handle.isTurn ? at : builder.placed(at, isExact));
            return handle.isTurn ? { heading: builder.snap(pulled.heading ?? 0, isExact ? FINE : TURN) % 360 } : pulled;
        }
        // The first end of a wall, or the center, is on the grid.
        const from = values.from ?? centerOf(values);
        const radius = thing?.kind === "robot" ? this.view.radii[thing.number] : 0;
        const [x, y] = builder.inside(builder.placed([from[0] + at[0] - start[0], from[1] + at[1] - start[1]], isExact), radius);
        return movedBy(values, [x - from[0], y - from[1]]);
    }

    /**
     * @param {Place} at
     * @param {PointerEvent} event
     */
    release(at, event) {
        const { builder, drag } = this;
        this.drag = null;
        if (!drag || event.type !== "pointerup") {
            return this.drop();
        }
        if (!drag.thing) {
            const to = builder.placed(at, event.shiftKey);
            const isDrawn = drag.hasMoved && Math.hypot(to[0] - drag.start[0], to[1] - drag.start[1]) >= LEAST;
            builder.add(drag.start, isDrawn ? to : undefined);
            return;
        }
        const values = drag.hasMoved && valuesOf(this.view, drag.thing);
        if (!values) {
            return this.drop();
        }
        builder.act(() => builder.change(this.pulled(drag, values, at, event.shiftKey), drag.thing));
    }

    // The pointer of the mouse over a place.
    /** @param {Place} at */
    cursorAt(at) {
        if (this.builder.tool !== "choose") {
            return "crosshair";
        }
        return handleAt(this.view, this.handles(), at) ? "grab" : thingAt(this.view, at) ? "move" : "";
    }

    // Returns true if the key belongs to this mode.
    /** @param {KeyboardEvent} event */
    key(event) {
        const { builder } = this;
        const { key } = event;
        /** @type {Record<string, () => void>} */
        const withControl = {
            c: () => builder.copy(), v: () => builder.paste(), d: () => builder.duplicate(),
            z: () => builder.move(event.shiftKey ? "redo" : "undo"), y: () => builder.move("redo"),
        };
        const step = event.shiftKey ? FINE : GRID;
        /** @type {Record<string, () => void>} */
        const plain = {
            ArrowLeft: () => builder.nudge([-step, 0]), ArrowRight: () => builder.nudge([step, 0]), ArrowUp: () => builder.nudge([0, step]), ArrowDown: () => builder.nudge([0, -step]),
            r: () => builder.turn(TURN), R: () => builder.turn(-TURN), Delete: () => builder.delete(), Backspace: () => builder.delete(),
            n: () => builder.panel.step(1), p: () => builder.panel.step(-1), Enter: () => builder.add(builder.middle()),
            Escape: () => this.escape(),
        };
        const isControl = event.ctrlKey || event.metaKey;
        // A list has keys of its own.
        if (event.target instanceof HTMLSelectElement && !isControl && key !== "Delete" && key !== "Escape") {
            return false;
        }
        const isOnCanvas = event.target === this.view.canvas;
        const digit = TOOLS[Number(key) - 1];
        if (digit && !isControl && !event.altKey) {
            builder.take(digit);
            return true;
        }
        // Arrows and Enter are those of a button that has the focus, and arrows without a thing move the view.
        const isOfCanvas = key.startsWith("Arrow") || key === "Enter";
        if (!isControl && isOfCanvas && (!isOnCanvas || (key !== "Enter" && !builder.chosen))) {
            return false;
        }
        const act = (isControl ? withControl : plain)[isControl ? key.toLowerCase() : key];
        if (!act || event.altKey) {
            return false;
        }
        // A key that is held acts when the change before is made.
        if (!event.repeat || !builder.isBusy) {
            builder.act(act);
        }
        return true;
    }

    // One step out: of a tool, of the chosen thing, of the mode.
    escape() {
        const { builder } = this;
        if (builder.tool !== "choose") {
            builder.take("choose");
        } else if (builder.chosen) {
            builder.choose(null);
        } else {
            builder.leave();
        }
    }

    // Draws the chosen thing, its handles, and the thing that is dragged.
    draw() {
        const { view, ghost } = this;
        const { chosen, values } = this.builder;
        const handles = ghost || !chosen ? [] : this.handles();
        if (ghost) {
            drawThing(view, ghost.kind, ghost.values, ghost.number, [], true);
        } else if (chosen && values) {
            drawThing(view, chosen.kind, values, chosen.number, handles, false);
        }
    }
}
