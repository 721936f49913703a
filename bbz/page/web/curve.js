// A quantity over time: of all robots their quartiles and extremes, and the chosen robot.

import { element, onFrame, part, write } from "./element.js";
import { texts } from "./texts.js";
import { COMPARED } from "./view.js";

// Numbers that are kept so that the curve of any robot can be shown later; 16 MB.
const VALUES_MAX = 4e6;

/**
 * @import { QuantityEvent } from "./events"
 * @import { View } from "./view.js"
 */

/**
 * Extremes and quartiles, and the values of the robots if there is room for them.
 * @typedef {{ five: number[], values: (number | null)[] | null }} Point
 */

export class Curve {
    /** @param {View} view */
    constructor(view) {
        this.view = view;
        this.end = 1;
        /** @type {string | null} */
        this.name = null;
        this.last = 0;
        // By tick.
        /** @type {Map<number, Point>} */
        this.points = new Map();
        this.kept = 0;
        this.canvas = part("curve");
        this.changed = onFrame(() => this.draw());
        this.begin({ end: 1 });
        new ResizeObserver(() => this.changed()).observe(this.canvas);
        matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.changed());
    }

    /** @param {{ end: number }} world */
    begin(world) {
        this.end = world.end;
        this.name = null;
        this.clear();
    }

    clear() {
        this.points.clear();
        this.kept = 0;
        this.changed();
    }

    // The values at a tick. A single one is of the whole swarm.
    /** @param {QuantityEvent} event */
    take({ tick, name, values }) {
        if (name !== this.name) {
            this.name = name;
            this.clear();
        }
        const known = Float64Array.from(values.filter((value) => value !== null)).sort();
        this.kept -= this.points.get(tick)?.values?.length ?? 0;
        const isKept = this.kept + values.length <= VALUES_MAX;
        this.kept += isKept ? values.length : 0;
        const at = (/** @type {number} */ share) => quantile(known, share);
        this.points.set(tick, { five: [0, 0.25, 0.5, 0.75, 1].map(at), values: isKept ? values : null });
        this.last = tick;
        this.changed();
    }

    // Forgets what comes another way when the run goes on from a tick.
    /** @param {number} tick */
    forget(tick) {
        for (const [at, { values }] of this.points) {
            if (at > tick) {
                this.points.delete(at);
                this.kept -= values?.length ?? 0;
            }
        }
        this.changed();
    }

    draw() {
        const ticks = [...this.points.keys()].sort((one, other) => one - other);
        part("curves").hidden = ticks.length === 0;
        if (ticks.length === 0) {
            return;
        }
        const points = ticks.flatMap((tick) => this.points.get(tick) ?? []);
        const { chosen } = this.view;
        // A single number is one of the whole swarm.
        /** @type {(robot: number | null) => (point: Point) => number | null} */
        const of = (robot) => ({ values }) => (robot === null || values?.length === 1 ? null : values?.[robot]) ?? null;
        const ofChosen = of(chosen);
        this.describe(this.points.get(this.last) ?? points[points.length - 1], of);
        const known = points.flatMap(({ five }) => [five[0], five[4]]).filter(Number.isFinite);
        const [low, high] = known.reduce(([least, most], value) => [Math.min(least, value), Math.max(most, value)], [Infinity, -Infinity]);
        const { width, height, paint } = this.prepare();
        if (!(high >= low)) {
            return;
        }
        const x = (/** @type {number} */ index) => (ticks[index] / this.end) * width;
        const y = (/** @type {number} */ value) => height - 5 - ((value - low) / (high - low || 1)) * (height - 10);
        const style = getComputedStyle(document.documentElement);
        const color = (/** @type {string} */ name) => style.getPropertyValue(name);
        /** @type {(values: (number | null)[], name: string, wide: number) => void} */
        const line = (values, name, wide) => {
            paint.strokeStyle = color(name);
            paint.lineWidth = wide;
            paint.beginPath();
            let isDown = false;
            values.forEach((value, index) => {
                if (value !== null && Number.isFinite(value)) {
                    isDown ? paint.lineTo(x(index), y(value)) : paint.moveTo(x(index), y(value));
                }
                isDown = Number.isFinite(value);
            });
            paint.stroke();
        };
        const series = (/** @type {number} */ number) => points.map(({ five }) => five[number]);
        paint.fillStyle = color("--accent");
        paint.globalAlpha = 0.22;
        for (let index = 1; index < points.length; index++) {
            const [[, from1, , from3], [, to1, , to3]] = [points[index - 1].five, points[index].five];
            if (Number.isFinite(from1) && Number.isFinite(to1)) {
                paint.beginPath();
                paint.moveTo(x(index - 1), y(from1));
                paint.lineTo(x(index), y(to1));
                paint.lineTo(x(index), y(to3));
                paint.lineTo(x(index - 1), y(from3));
                paint.fill();
            }
        }
        paint.globalAlpha = 1;
        line(series(0), "--soft", 0.6);
        line(series(4), "--soft", 0.6);
        line(series(2), "--accent", 1.8);
        this.view.compared.forEach((robot, place) => line(points.map(of(robot)), COMPARED[place], 1.6));
        line(points.map(ofChosen), "--mark", 1.6);
        write(part("curve-high"), texts.number(high));
        write(part("curve-low"), texts.number(low));
    }

    // Clears the canvas, whose pixels are those of the screen.
    prepare() {
        const { canvas } = this;
        const ratio = globalThis.devicePixelRatio || 1;
        const [width, height] = [canvas.clientWidth, canvas.clientHeight];
        canvas.width = Math.round(width * ratio);
        canvas.height = Math.round(height * ratio);
        const paint = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
        paint.scale(ratio, ratio);
        return { width, height, paint };
    }

    // The curve in words.
    /**
     * @param {Point} point
     * @param {(robot: number | null) => (point: Point) => number | null} of
     */
    describe(point, of) {
        const { chosen, compared, robots } = this.view;
        /** @type {(robot: number | null, name: string) => Node[]} */
        const own = (robot, name) => {
            const value = of(robot)(point);
            return robot === null || value === null ? [] : [element("span", { class: name }, texts.curveOf(robots.ids[robot], value))];
        };
        part("curve-text").replaceChildren(texts.curve(this.name ?? "", point.five, point.values?.length ?? 2),
            ...own(chosen, "mark"), ...compared.flatMap((robot, place) => own(robot, COMPARED[place].slice(2))));
    }
}

// Between the two nearest of the ascending values; NaN without any.
/**
 * @param {ArrayLike<number>} values
 * @param {number} share
 */
export function quantile(values, share) {
    if (values.length === 0) {
        return NaN;
    }
    const at = share * (values.length - 1);
    const low = Math.floor(at);
    return values[low] + (values[Math.ceil(at)] - values[low]) * (at - low);
}
