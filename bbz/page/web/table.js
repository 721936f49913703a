// The table of all robots: the twin of the picture, for the keyboard and for screen readers.

import { element, onFrame, part, write } from "./element.js";
import { texts } from "./texts.js";

// Pixels of a row: rows that are not in sight are not in the page, so that a large swarm takes no more time than a small one.
const ROW = 28;

/**
 * @import { Robots } from "./recording.js"
 * @import { World } from "./page"
 */

export class Table {
    // `onChoose(robot)` when a row is chosen, `onOpen()` when more about the chosen robot is asked for.
    /**
     * @param {Robots} robots
     * @param {(robot: number | null) => void} onChoose
     * @param {() => void} onOpen
     */
    constructor(robots, onChoose, onOpen) {
        this.robots = robots;
        this.onChoose = onChoose;
        this.onOpen = onOpen;
        this.count = 0;
        this.isSeen = true;
        /** @type {number | null} */
        this.chosen = null;
        this.changed = onFrame(() => this.draw());
        this.grid = part("robots");
        this.rows = part("robots-rows");
        this.space = part("robots-space");
        inRow(part("robots-head"), texts.robotsHead.map((text) => element("span", { role: "columnheader" }, text)));
        this.grid.addEventListener("scroll", () => this.changed());
        this.grid.addEventListener("keydown", (event) => this.key(event));
        this.grid.addEventListener("dblclick", () => this.chosen !== null && this.onOpen());
        new ResizeObserver(() => this.changed()).observe(this.grid);
    }

    /** @param {World} world */
    begin(world) {
        this.count = world.groups.reduce((sum, { count }) => sum + count, 0);
        // Robots outside the simulator report neither places nor LEDs.
        this.isSeen = !world.watched;
        this.grid.setAttribute("aria-rowcount", String(this.count + 1));
        this.space.style.height = `${this.count * ROW}px`;
        this.changed();
    }

    /** @param {number | null} robot */
    choose(robot) {
        this.chosen = robot;
        if (robot !== null) {
            this.reveal(robot);
        }
        this.changed();
    }

    // Scrolls no more than it has to.
    /** @param {number} robot */
    reveal(robot) {
        const { grid } = this;
        const room = grid.clientHeight - part("robots-head").clientHeight;
        if (room > 0) {
            grid.scrollTop = Math.max((robot + 1) * ROW - room, Math.min(robot * ROW, grid.scrollTop));
        }
    }

    /** @param {KeyboardEvent} event */
    key(event) {
        const page = Math.max(1, Math.floor(this.grid.clientHeight / ROW) - 2);
        /** @type {Record<string, number>} */
        const ways = { ArrowDown: 1, ArrowUp: -1, PageDown: page, PageUp: -page, Home: -Infinity, End: Infinity };
        const way = ways[event.key];
        if (way !== undefined) {
            const from = this.chosen ?? (way > 0 ? -1 : 0);
            this.onChoose(Math.max(0, Math.min(this.count - 1, from + way)));
        } else if (event.key === "Enter" && this.chosen !== null) {
            this.onOpen();
        } else if (event.key === "Escape") {
            this.onChoose(null);
        } else {
            return;
        }
        // The beginning of the run has another key here.
        event.stopPropagation();
        event.preventDefault();
    }

    draw() {
        const { grid, rows, robots } = this;
        // The place of a hidden part would cost a layout for each picture.
        if (part("table").hidden) {
            return;
        }
        const first = Math.max(0, Math.floor(grid.scrollTop / ROW) - 2);
        const last = Math.min(this.count, first + Math.ceil(grid.clientHeight / ROW) + 4);
        rows.style.transform = `translateY(${first * ROW}px)`;
        // Rows are used again: one that is pressed stays the same element.
        while (rows.children.length < last - first) {
            const row = inRow(element("div", { role: "row", onclick: () => this.onChoose(Number(row.dataset.robot)) }),
                texts.robotsHead.map(() => element("span", { role: "gridcell" })));
            rows.append(row);
        }
        while (rows.children.length > last - first) {
            rows.lastElementChild?.remove();
        }
        for (let robot = first; robot < last; robot++) {
            const row = /** @type {HTMLElement} */ (rows.children[robot - first]);
            const isChosen = robot === this.chosen;
            row.id = `robots-${robot}`;
            row.dataset.robot = String(robot);
            row.setAttribute("aria-rowindex", String(robot + 2));
            row.setAttribute("aria-selected", String(isChosen));
            this.cells(robot).forEach((text, column) => {
                const cell = row.children[column];
                if (cell.textContent !== text) {
                    write(cell, text);
                }
            });
            row.children[1].className = `state s${robots.state[robot]}`;
        }
        const isInSight = this.chosen !== null && this.chosen >= first && this.chosen < last;
        grid.setAttribute("aria-activedescendant", isInSight ? `robots-${this.chosen}` : "");
    }

    /** @param {number} robot */
    cells(robot) {
        const { robots, isSeen } = this;
        // Three numbers have less room than two.
        const digits = this.grid.classList.contains("flying") ? 0 : 1;
        const mm = (/** @type {Int32Array} */ axis) => (isSeen ? (axis[robot] / 10).toFixed(digits) : "");
        return [String(robots.ids[robot] ?? robot), texts.states[robots.state[robot]] ?? "", mm(robots.x), mm(robots.y), mm(robots.z), isSeen ? texts.ledName(robots.led[robot] ?? 0) : ""];
    }
}

/**
 * @param {HTMLElement} row
 * @param {HTMLElement[]} cells
 */
function inRow(row, cells) {
    row.append(...cells);
    return row;
}
