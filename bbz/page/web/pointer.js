// The actions of the mouse, fingers and keys in the view.

// Pixels that a click may move.
const SLACK = 4;
// Radians for each pixel of a turn, and for each key.
const TURN = 0.01;
const KEY_TURN = Math.PI / 24;

/**
 * @import { Place } from "./page"
 * @import { View } from "./view.js"
 */

/**
 * Actions in the view: robots and lamps by their numbers, places in mm.
 * @typedef {object} Actions
 * @property {(robot: number | null) => void} onChoose
 * @property {(robot: number) => void} onCompare
 * @property {(robot: number, at: Place) => void} onMove
 * @property {(lamp: number, at: Place) => void} onLamp
 * @property {() => void} onLook the user looks elsewhere
 * @property {() => void} onFollow
 * @property {(from: Place, to: Place) => void} onCut
 */

/**
 * A mode in which the mouse and the keys build the world.
 * @typedef {object} Hand
 * @property {boolean} isOn
 * @property {(at: Place, event: PointerEvent) => boolean} press returns false if the view moves
 * @property {(at: Place, event: PointerEvent) => void} pull
 * @property {(at: Place, event: PointerEvent) => void} release
 * @property {(at: Place) => string} cursorAt
 * @property {(event: KeyboardEvent) => boolean} key returns true for a key of its own
 */

/**
 * A pressed button or finger, with the robot or lamp below it.
 * @typedef {{ robot: number | null, lamp: number | null, x: number, y: number, hasMoved: boolean, isTurning: boolean, isOfHand?: boolean }} Pressed
 */

export class Pointer {
    /**
     * @param {View} view
     * @param {Actions} actions
     * @param {Hand} hand
     */
    constructor(view, actions, hand) {
        this.view = view;
        this.hand = hand;
        this.actions = actions;
        // The place of each finger.
        /** @type {Map<number, PointerEvent>} */
        this.down = new Map();
        /** @type {Pressed | null} */
        this.pressed = null;
        const { canvas } = view;
        canvas.addEventListener("pointerdown", (event) => this.press(event));
        canvas.addEventListener("pointermove", (event) => this.move(event));
        canvas.addEventListener("pointerup", (event) => this.release(event));
        canvas.addEventListener("pointercancel", (event) => this.release(event));
        canvas.addEventListener("dblclick", () => {
            actions.onLook();
            view.fit();
        });
        canvas.addEventListener("wheel", (event) => {
            event.preventDefault();
            view.zoom(Math.exp(-event.deltaY / 500), view.toWorld(event));
        }, { passive: false });
        canvas.addEventListener("contextmenu", (event) => view.camera.isTilted && event.preventDefault());
        canvas.addEventListener("keydown", (event) => this.key(event));
    }

    /** @param {PointerEvent} event */
    press(event) {
        const { view } = this;
        view.canvas.setPointerCapture(event.pointerId);
        this.down.set(event.pointerId, event);
        if (this.down.size > 1) {
            this.pressed = null;
            view.dragged = null;
            return;
        }
        if (view.camera.isTilted && event.button === 2) {
            this.pressed = { robot: null, lamp: null, x: event.clientX, y: event.clientY, hasMoved: true, isTurning: true };
            return;
        }
        const at = view.toWorld(event);
        if (view.isCutting) {
            view.cut = [at, at];
            return;
        }
        if (this.hand.isOn) {
            const isOfHand = event.button === 0 && this.hand.press(at, event);
            this.pressed = { robot: null, lamp: null, x: event.clientX, y: event.clientY, hasMoved: false, isTurning: false, isOfHand };
            return;
        }
        const robot = view.robotAt(at);
        this.pressed = { robot, lamp: robot === null ? view.lampAt(at) : null, x: event.clientX, y: event.clientY, hasMoved: false, isTurning: false };
    }

    /** @param {PointerEvent} event */
    move(event) {
        const { view, pressed, down } = this;
        if (down.size === 2 && down.has(event.pointerId)) {
            return this.pinch(event);
        }
        if (view.isCutting) {
            if (view.cut) {
                view.cut = [view.cut[0], view.toWorld(event)];
                view.changed();
            }
            return;
        }
        if (!pressed) {
            const at = view.toWorld(event);
            if (this.hand.isOn) {
                view.canvas.style.cursor = this.hand.cursorAt(at) || "grab";
                return;
            }
            const isOver = view.robotAt(at) !== null || view.lampAt(at) !== null;
            view.canvas.style.cursor = isOver ? "pointer" : "grab";
            return;
        }
        const [right, below] = [event.clientX - pressed.x, event.clientY - pressed.y];
        if (!pressed.hasMoved && Math.hypot(right, below) < SLACK) {
            return;
        }
        pressed.hasMoved = true;
        if (pressed.isTurning) {
            view.turnBy(right * TURN, below * TURN);
            [pressed.x, pressed.y] = [event.clientX, event.clientY];
        } else if (pressed.isOfHand) {
            this.hand.pull(view.toWorld(event), event);
        } else if (pressed.robot !== null || pressed.lamp !== null) {
            const at = view.toWorld(event, pressed.robot === null ? 0 : view.robots.z[pressed.robot] / 10);
            view.dragged = { robot: pressed.robot, lamp: pressed.lamp, at: this.onGround(at, pressed.robot) };
            view.changed();
        } else {
            this.actions.onLook();
            view.pan(right, below);
            [pressed.x, pressed.y] = [event.clientX, event.clientY];
        }
    }

    // The nearest place within the border of the world, at which no part of a robot is outside.
    /**
     * @param {Place} place
     * @param {number | null} robot
     * @returns {Place}
     */
    onGround([x, y], robot) {
        const { world, radii } = this.view;
        const [right, up] = (world?.size ?? [0, 0]).map((side) => Math.max(0, side / 2 - (robot === null ? 0 : radii[robot])));
        return [Math.max(-right, Math.min(right, x)), Math.max(-up, Math.min(up, y))];
    }

    // Two fingers zoom and move at once, and turn the world in 3-D. The place between them stays there, however far the fingers
    // move from one event to the next.
    /** @param {PointerEvent} event */
    pinch(event) {
        const { view, down } = this;
        const [other] = [...down.values()].filter((one) => one.pointerId !== event.pointerId);
        const before = down.get(event.pointerId) ?? event;
        /** @type {(one: PointerEvent) => number} */
        const apart = (one) => Math.max(1, Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY));
        /** @type {(one: PointerEvent) => number} */
        const angle = (one) => Math.atan2(one.clientY - other.clientY, one.clientX - other.clientX);
        /** @type {(one: PointerEvent) => { clientX: number, clientY: number }} */
        const middle = (one) => ({ clientX: (one.clientX + other.clientX) / 2, clientY: (one.clientY + other.clientY) / 2 });
        const between = view.toWorld(middle(before));
        view.zoom(apart(event) / apart(before));
        view.turnBy(angle(before) - angle(event), 0);
        view.hold(between, middle(event));
        down.set(event.pointerId, event);
    }

    /** @param {PointerEvent} event */
    release(event) {
        const { view, pressed, actions } = this;
        this.down.delete(event.pointerId);
        this.pressed = null;
        if (view.cut) {
            const [from, to] = view.cut;
            [view.cut, view.isCutting] = [null, false];
            view.canvas.style.cursor = "";
            view.changed();
            if (event.type === "pointerup") {
                actions.onCut(from, to);
            }
        }
        if (!pressed) {
            return;
        }
        if (pressed.isOfHand) {
            this.hand.release(view.toWorld(event), event);
            return;
        }
        if (this.hand.isOn) {
            return;
        }
        if (!pressed.hasMoved) {
            event.shiftKey && pressed.robot !== null ? actions.onCompare(pressed.robot) : actions.onChoose(pressed.robot);
        } else if (view.dragged && event.type === "pointerup") {
            const { robot, lamp, at } = view.dragged;
            if (robot !== null) {
                actions.onMove(robot, at);
            } else if (lamp !== null) {
                actions.onLamp(lamp, at);
            }
        }
        view.dragged = null;
        view.changed();
    }

    /** @param {KeyboardEvent} event */
    key(event) {
        const { view, actions } = this;
        if (this.hand.isOn && this.hand.key(event)) {
            event.preventDefault();
            return;
        }
        /** @type {Record<string, Place>} */
        const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
        /** @type {Place | undefined} */
        const arrow = arrows[event.key];
        if (arrow && event.shiftKey && view.chosen !== null) {
            const [x, y] = view.placeOf(view.chosen);
            actions.onMove(view.chosen, this.onGround([x + 10 * arrow[0], y + 10 * arrow[1]], view.chosen));
        } else if (arrow && event.ctrlKey) {
            view.turnBy(KEY_TURN * arrow[0], KEY_TURN * arrow[1]);
        } else if (arrow) {
            actions.onLook();
            view.pan(-40 * arrow[0], 40 * arrow[1]);
        } else if (event.key === "+" || event.key === "-") {
            view.zoom(event.key === "+" ? 1.25 : 0.8);
        } else if (event.key === "0") {
            actions.onLook();
            view.fit();
        } else if (event.key === "f" && !event.ctrlKey && !event.metaKey) {
            actions.onFollow();
        } else if (event.key === "r" && !event.ctrlKey && !event.metaKey) {
            actions.onLook();
            view.fitRobots();
        } else if (event.key === "n" || event.key === "p") {
            const next = (view.chosen ?? -1) + (event.key === "n" ? 1 : -1);
            actions.onChoose(Math.max(0, Math.min(view.robots.count - 1, next)));
        } else if (event.key === "c" && view.chosen !== null && !event.ctrlKey && !event.metaKey) {
            actions.onCompare(view.chosen);
        } else if (event.key === "Escape") {
            actions.onChoose(null);
        } else {
            return;
        }
        event.preventDefault();
    }
}
