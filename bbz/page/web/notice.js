// Notices: the answers of the session stand where the user has acted, and over the page, so that nothing else moves.

import { part, write } from "./element.js";

// Pixels between a notice and its place, and the edge of the window.
const AWAY = 14;
const EDGE = 8;

/**
 * The kinds of notices: `progress` of the run, or an `error` of it, stands next to its clock, the `answer` to an action next to the
 * place of the action.
 * @typedef {"progress" | "answer" | "error"} NoticeKind
 */

export class Notice {
    /** @param {() => void} onClose */
    constructor(onClose) {
        this.onClose = onClose;
        this.slot = part("notice");
        this.box = part("notice-box");
        this.text = part("status");
        /** @type {NoticeKind} */
        this.kind = "progress";
        // The part of the page in which the user has acted last, and the place of the pointer in the world.
        /** @type {Element | null} */
        this.acted = null;
        /** @type {{ x: number, y: number } | null} */
        this.pointer = null;
        addEventListener("pointerup", (event) => this.note(event.target, { x: event.clientX, y: event.clientY }), true);
        addEventListener("keydown", (event) => this.note(event.target, null), true);
        addEventListener("keydown", ({ key }) => key === "Escape" && this.close());
        addEventListener("resize", () => this.place());
        part("close-notice").onclick = () => this.close();
    }

    /**
     * @param {EventTarget | null} target
     * @param {{ x: number, y: number } | null} pointer
     */
    note(target, pointer) {
        if (target instanceof Element && !this.slot.contains(target)) {
            this.acted = target.closest("button, canvas, label, select, input, #text") ?? target;
            this.pointer = target.matches("canvas") ? pointer : null;
        }
    }

    /**
     * @param {string} text
     * @param {NoticeKind} kind
     */
    show(text, kind) {
        this.kind = kind;
        // Screen readers would read the same text again.
        if (this.text.textContent !== text) {
            write(this.text, text);
        }
        this.box.className = kind;
        this.place();
    }

    close() {
        this.text.textContent = "";
        this.onClose();
    }

    // A text that has no room in the header stands over the world if it is an error, else next to the scale.
    place() {
        const { box, text, kind } = this;
        box.classList.remove("floats");
        [box.style.left, box.style.top] = ["", ""];
        if (text.textContent === "" || (kind !== "answer" && text.scrollWidth <= text.clientWidth)) {
            return;
        }
        box.classList.add("floats");
        const [left, top] = kind === "answer" ? this.besideAction() : kind === "error" ? this.overWorld() : this.belowWorld();
        const { width, height } = box.getBoundingClientRect();
        box.style.left = `${Math.max(EDGE, Math.min(left, innerWidth - width - EDGE))}px`;
        box.style.top = `${Math.max(EDGE, Math.min(top, innerHeight - height - EDGE))}px`;
    }

    // No button lies below it there.
    overWorld() {
        const { left, right, top } = part("stage").getBoundingClientRect();
        const slot = this.slot.getBoundingClientRect().left;
        return [Math.max(left, Math.min(slot, right - this.box.getBoundingClientRect().width - 2 * EDGE)) + EDGE, top + EDGE];
    }

    // Beside the buttons there, or above them.
    belowWorld() {
        const world = part("below").getBoundingClientRect();
        const { left, top, bottom } = part("view-acts").getBoundingClientRect();
        const { width, height } = this.box.getBoundingClientRect();
        if (left - width - EDGE >= world.left) {
            return [left - width - EDGE, (top + bottom - height) / 2];
        }
        return [world.right - width - EDGE, world.top - height - EDGE];
    }

    // Next to the pointer in the world; over the world, at the height of what was pressed in a panel, if there is room.
    besideAction() {
        const { acted, pointer, box } = this;
        if (pointer) {
            return [pointer.x + AWAY, pointer.y + AWAY];
        }
        if (!acted?.isConnected) {
            return this.overWorld();
        }
        const { width, height } = box.getBoundingClientRect();
        const { left, top, bottom } = acted.getBoundingClientRect();
        const panel = acted.closest("aside")?.getBoundingClientRect();
        if (acted.matches("canvas")) {
            return [left + AWAY, top + AWAY];
        }
        if (panel && panel.left >= width + 2 * EDGE) {
            return [panel.left - width - EDGE, top];
        }
        return [left, top > height + 2 * EDGE ? top - height - EDGE : bottom + EDGE];
    }
}
