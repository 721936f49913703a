// What the mouse, fingers and keys do in the view.

// Pixels that a click may move.
const SLACK = 4;
// Radians for each pixel of a turn, and for each key.
const TURN = 0.01;
const KEY_TURN = Math.PI / 24;

export class Pointer {
    // `onChoose(robot)` with its number or null; `onCompare(robot)`; `onMove(robot, [x, y])`, `onLamp(lamp, [x, y])` and `onCut([x, y], [x, y])` in mm.
    constructor(view, { onChoose, onCompare, onMove, onLamp, onCut }) {
        Object.assign(this, { view, onChoose, onCompare, onMove, onLamp, onCut });
        // Where each finger is.
        this.down = new Map();
        this.pressed = null;
        const { canvas } = view;
        canvas.addEventListener("pointerdown", (event) => this.press(event));
        canvas.addEventListener("pointermove", (event) => this.move(event));
        canvas.addEventListener("pointerup", (event) => this.release(event));
        canvas.addEventListener("pointercancel", (event) => this.release(event));
        canvas.addEventListener("dblclick", () => view.fit());
        canvas.addEventListener("wheel", (event) => {
            event.preventDefault();
            view.zoom(Math.exp(-event.deltaY / 500), view.toWorld(event));
        }, { passive: false });
        canvas.addEventListener("contextmenu", (event) => view.camera.isTilted && event.preventDefault());
        canvas.addEventListener("keydown", (event) => this.key(event));
    }

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
            this.pressed = { isTurning: true, hasMoved: true, x: event.clientX, y: event.clientY };
            return;
        }
        const at = view.toWorld(event);
        if (view.isCutting) {
            view.cut = [at, at];
            return;
        }
        const robot = view.robotAt(at);
        this.pressed = { robot, lamp: robot === null ? view.lampAt(at) : null, x: event.clientX, y: event.clientY, hasMoved: false };
    }

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
        } else if (pressed.robot !== null || pressed.lamp !== null) {
            view.dragged = { robot: pressed.robot, lamp: pressed.lamp, at: view.toWorld(event, view.robots.z[pressed.robot] / 10 || 0) };
            view.changed();
        } else {
            view.pan(right, below);
            [pressed.x, pressed.y] = [event.clientX, event.clientY];
        }
    }

    // Two fingers zoom and move at once, and turn the world in 3-D.
    pinch(event) {
        const { view, down } = this;
        const [other] = [...down.values()].filter((one) => one.pointerId !== event.pointerId);
        const before = down.get(event.pointerId);
        const apart = (one) => Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY);
        const angle = (one) => Math.atan2(one.clientY - other.clientY, one.clientX - other.clientX);
        const middle = (one) => ({ clientX: (one.clientX + other.clientX) / 2, clientY: (one.clientY + other.clientY) / 2 });
        const [from, to] = [middle(before), middle(event)];
        view.pan(to.clientX - from.clientX, to.clientY - from.clientY);
        view.zoom(apart(event) / Math.max(1, apart(before)), view.toWorld(to));
        view.turnBy(angle(before) - angle(event), 0);
        down.set(event.pointerId, event);
    }

    release(event) {
        const { view, pressed } = this;
        this.down.delete(event.pointerId);
        this.pressed = null;
        if (view.cut) {
            const line = view.cut;
            [view.cut, view.isCutting] = [null, false];
            view.canvas.style.cursor = "";
            view.changed();
            if (event.type === "pointerup") {
                this.onCut(...line);
            }
        }
        if (!pressed) {
            return;
        }
        if (!pressed.hasMoved) {
            event.shiftKey && pressed.robot !== null ? this.onCompare(pressed.robot) : this.onChoose(pressed.robot);
        } else if (view.dragged && event.type === "pointerup") {
            const { robot, lamp, at } = view.dragged;
            robot === null ? this.onLamp(lamp, at) : this.onMove(robot, at);
        }
        view.dragged = null;
        view.changed();
    }

    key(event) {
        const { view } = this;
        const arrow = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
        if (arrow && event.shiftKey && view.chosen !== null) {
            const [x, y] = view.placeOf(view.chosen);
            this.onMove(view.chosen, [x + 10 * arrow[0], y + 10 * arrow[1]]);
        } else if (arrow && event.ctrlKey) {
            view.turnBy(KEY_TURN * arrow[0], KEY_TURN * arrow[1]);
        } else if (arrow) {
            view.pan(-40 * arrow[0], 40 * arrow[1]);
        } else if (event.key === "+" || event.key === "-") {
            view.zoom(event.key === "+" ? 1.25 : 0.8);
        } else if (event.key === "0") {
            view.fit();
        } else if (event.key === "n" || event.key === "p") {
            const next = (view.chosen ?? -1) + (event.key === "n" ? 1 : -1);
            this.onChoose(Math.max(0, Math.min(view.robots.count - 1, next)));
        } else if (event.key === "c" && view.chosen !== null && !event.ctrlKey && !event.metaKey) {
            this.onCompare(view.chosen);
        } else if (event.key === "Escape") {
            this.onChoose(null);
        } else {
            return;
        }
        event.preventDefault();
    }
}
