// A panel with a quantity over time: of all robots their quartiles and extremes, and single robots.

import { element, onFrame, option, saveTable, write } from "./element.js";
import { Scale, ticks } from "./scale.js";
import { texts } from "./texts.js";
import { COMPARED } from "./view.js";

// Pixels around the plane of a curve, in which the axes have their numbers.
const [LEFT, RIGHT, TOP, BOTTOM] = [48, 18, 7, 18];

// Bands of expectations in one panel: more cannot be distinguished.
const BANDS_MAX = 400;

/**
 * @import { SeriesEvent } from "./events"
 * @import { Expectation, World } from "./page"
 * @import { ScaleKind } from "./scale.js"
 * @import { View } from "./view.js"
 */

/**
 * @typedef {{ onClose: () => void, onCursor: (tick: number | null) => void, onGo: (tick: number) => void }} Listener
 */

export class Curve {
    /**
     * @param {string} name of the quantity
     * @param {View} view
     * @param {World} world
     * @param {Listener} listener
     */
    constructor(name, view, world, listener) {
        this.name = name;
        this.view = view;
        this.world = world;
        /** @type {ScaleKind} */
        this.kind = "all";
        this.unit = "";
        this.every = 1;
        // Pixels of the plot, which are asked for when it is drawn: asking costs a layout of the page.
        this.width = 0;
        this.isSingle = false;
        // Extremes, quartiles and median by tick in steps of `every`; holes are not known yet.
        /** @type {(number[] | undefined)[]} */
        this.points = [];
        // The values of single robots, by robot.
        /** @type {Map<number, (number | null)[]>} */
        this.own = new Map();
        this.now = 0;
        /** @type {number | null} */
        this.cursor = null;
        this.title = element("b", {}, name);
        this.words = element("span", { class: "words" });
        this.canvas = element("canvas", { role: "img", "aria-label": texts.curveLabel(name) });
        this.nowLine = element("i", { class: "now" });
        this.cursorLine = element("i", { class: "cursor" });
        this.scale = element("select", { "aria-label": texts.scaleOf(name), onchange: () => this.choose(/** @type {ScaleKind} */ (this.scale.value)) });
        this.scale.append(...Object.entries(texts.scales).map(([kind, text]) => option(text, kind)));
        this.plot = element("div", { class: "plot" }, this.canvas, this.nowLine, this.cursorLine);
        this.panel = element("section", { class: "curve", "aria-label": texts.curveLabel(name) },
            element("div", { class: "head" }, this.title, this.words, this.scale,
                element("button", { type: "button", title: texts.saveCurveHelp, "aria-label": texts.saveCurve(name), onclick: () => this.save() }, texts.csv),
                element("button", { type: "button", class: "icon", title: texts.closeCurve(name), "aria-label": texts.closeCurve(name), onclick: listener.onClose }, "×")),
            this.plot);
        this.plot.addEventListener("pointermove", (event) => listener.onCursor(this.tickAt(event)));
        this.plot.addEventListener("pointerleave", () => listener.onCursor(null));
        // The tick that the pointer shows: a click has whole pixels.
        this.plot.addEventListener("click", (event) => listener.onGo(this.cursor ?? this.tickAt(event)));
        this.changed = () => drawSoon(this);
        // A panel that is taken out has no size, and is not drawn again.
        new ResizeObserver(() => this.changed()).observe(this.plot);
        this.changed();
    }

    /** @param {ScaleKind} kind */
    choose(kind) {
        this.kind = kind;
        this.scale.value = kind;
        this.changed();
    }

    // Points that have become known.
    /** @param {SeriesEvent} event */
    take({ unit, every, is_single: isSingle, ticks: at, five, robots, own }) {
        [this.unit, this.every, this.isSingle] = [unit ?? "", every, isSingle];
        at.forEach((tick, place) => {
            const index = tick / every;
            if (five.length > 0) {
                this.points[index] = five[place].map((value) => value ?? NaN);
            }
            robots.forEach((robot, column) => {
                const values = this.own.get(robot) ?? [];
                this.own.set(robot, values);
                values[index] = own[place][column];
            });
        });
        this.changed();
    }

    // Forgets the points after a tick.
    /** @param {number} tick */
    cut(tick) {
        const count = Math.floor(tick / this.every) + 1;
        for (const list of [this.points, ...this.own.values()]) {
            list.length = Math.min(list.length, count);
        }
        this.changed();
    }

    /** @param {number} now the tick that the world shows */
    show(now) {
        this.now = now;
        this.place();
    }

    // The tick of all panels under the pointer.
    /** @param {number | null} tick */
    point(tick) {
        this.cursor = tick;
        this.place();
    }

    /** @param {MouseEvent} event */
    tickAt({ clientX }) {
        const { left, width } = this.plot.getBoundingClientRect();
        const share = (clientX - left - LEFT) / Math.max(1, width - LEFT - RIGHT);
        return Math.round(Math.max(0, Math.min(1, share)) * this.world.end);
    }

    // Places both lines, which need no drawing of the curve.
    place() {
        const room = this.width - LEFT - RIGHT;
        /** @type {[HTMLElement, number | null][]} */
        const lines = [[this.nowLine, this.now], [this.cursorLine, this.cursor]];
        for (const [line, tick] of lines) {
            line.hidden = tick === null;
            // By the object model: the page's policy allows no styles in attributes.
            line.style.left = `${LEFT + (room * (tick ?? 0)) / this.world.end}px`;
        }
        this.describe();
    }

    // The values at the pointer or at the present, in words.
    describe() {
        const tick = this.cursor ?? this.now;
        const index = Math.round(tick / this.every);
        const five = this.points[index];
        write(this.title, this.unit ? texts.inUnit(this.name, this.unit) : this.name);
        const time = texts.seconds((index * this.every) / this.world.ticks_per_second);
        const { ids } = this.view.robots;
        const own = five && !this.isSingle ? this.robots().flatMap(({ robot, color }) => {
            const value = this.own.get(robot)?.[index];
            return value === null || value === undefined ? [] : [element("span", { class: color.slice(2) }, texts.curveOf(ids[robot], value))];
        }) : [];
        this.words.replaceChildren(five ? texts.curve(time, five, this.isSingle || ids.length === 1) : texts.noPoint(time), ...own);
    }

    // The robots that have lines of their own, and the names of their colors.
    robots() {
        const { chosen, compared } = this.view;
        const all = compared.flatMap((robot, place) => (robot === null ? [] : [{ robot, color: COMPARED[place] }]));
        return chosen === null ? all : [...all, { robot: chosen, color: "--mark" }];
    }

    // The expectations about this quantity.
    bands() {
        return this.world.expectations.filter(({ band }) => band?.quantity === this.name).slice(0, BANDS_MAX);
    }

    draw() {
        const { width, height, paint } = this.prepare();
        this.width = width;
        this.place();
        const room = { width: width - LEFT - RIGHT, height: height - TOP - BOTTOM };
        if (room.width <= 0 || room.height <= 0) {
            return;
        }
        const style = getComputedStyle(document.documentElement);
        const color = (/** @type {string} */ name) => style.getPropertyValue(name);
        const bands = this.bands();
        const limits = bands.flatMap(({ band }) => [band?.low ?? null, band?.high ?? null]).filter((limit) => limit !== null);
        const scale = new Scale(this.kind, this.points.flatMap((five) => (five ? [five] : [])), limits);
        const x = (/** @type {number} */ tick) => LEFT + (tick / this.world.end) * room.width;
        const y = (/** @type {number} */ value) => TOP + (1 - scale.share(value)) * room.height;
        paint.font = `11px ${getComputedStyle(this.canvas).fontFamily}`;
        paint.fillStyle = color("--soft");
        paint.strokeStyle = color("--grid");
        paint.textAlign = "center";
        paint.textBaseline = "top";
        const perSecond = this.world.ticks_per_second;
        for (const seconds of ticks(0, this.world.end / perSecond, room.width / 80)) {
            const at = Math.round(x(seconds * perSecond)) + 0.5;
            line(paint, [[at, TOP], [at, TOP + room.height]]);
            paint.fillText(texts.timeTick(seconds), at, TOP + room.height + 4);
        }
        paint.textAlign = "right";
        paint.textBaseline = "middle";
        if (scale.isKnown) {
            for (const value of scale.ticks(room.height / 24)) {
                const at = Math.round(y(value)) + 0.5;
                line(paint, [[LEFT, at], [LEFT + room.width, at]]);
                paint.fillText(texts.number(value), LEFT - 6, at);
            }
        }
        paint.strokeStyle = color("--line");
        line(paint, [[LEFT + 0.5, TOP], [LEFT + 0.5, TOP + room.height + 0.5], [LEFT + room.width, TOP + room.height + 0.5]]);
        if (!scale.isKnown) {
            const isUnknown = this.points.length === 0;
            paint.textAlign = "center";
            paint.fillText(isUnknown ? "" : this.kind === "log" ? texts.nothingPositive : texts.noNumbers, LEFT + room.width / 2, TOP + room.height / 2);
            return;
        }
        paint.save();
        paint.beginPath();
        paint.rect(LEFT, TOP - 1, room.width + 1, room.height + 2);
        paint.clip();
        bands.forEach((one) => this.drawBand(paint, one, scale, x, y, color));
        this.drawLines(paint, x, y, color);
        paint.restore();
        paint.fillStyle = color("--soft");
        paint.strokeStyle = color("--ground");
        paint.lineWidth = 4;
        paint.textAlign = "left";
        const text = (/** @type {string} */ shown, /** @type {number} */ at) => {
            paint.strokeText(shown, LEFT + 5, at);
            paint.fillText(shown, LEFT + 5, at);
        };
        // The values that the scale leaves out.
        if (Number.isFinite(scale.above)) {
            text(texts.above(scale.above), TOP + 7);
        }
        if (Number.isFinite(scale.below)) {
            text(texts.below(scale.below), TOP + room.height - 7);
        }
    }

    /**
     * @param {CanvasRenderingContext2D} paint
     * @param {Expectation} expectation
     * @param {Scale} scale
     * @param {(tick: number) => number} x
     * @param {(value: number) => number} y
     * @param {(name: string) => string} color
     */
    drawBand(paint, { band, verdict }, scale, x, y, color) {
        if (!band) {
            return;
        }
        const perSecond = this.world.ticks_per_second;
        // A logarithm has no place for 0.
        const inside = (/** @type {number | null} */ limit, /** @type {number} */ other) => (limit === null || (scale.isLog && limit <= 0) ? other : limit);
        const [left, right] = [x(band.from * perSecond), x(band.to * perSecond)];
        const [top, bottom] = [y(inside(band.high, scale.high)), y(inside(band.low, scale.low))];
        // An instant, or a single value, can still be seen.
        const [wide, tall] = [Math.max(0, 5 - (right - left)) / 2, Math.max(0, 4 - (bottom - top)) / 2];
        paint.fillStyle = color(verdict === "held" ? "--held" : verdict === "failed" ? "--faulted" : "--soft");
        paint.globalAlpha = 0.28;
        paint.fillRect(left - wide, top - tall, right - left + 2 * wide, bottom - top + 2 * tall);
        paint.globalAlpha = 1;
    }

    /**
     * @param {CanvasRenderingContext2D} paint
     * @param {(tick: number) => number} x
     * @param {(value: number) => number} y
     * @param {(name: string) => string} color
     */
    drawLines(paint, x, y, color) {
        /** @type {(values: (number | null | undefined)[], name: string, wide: number) => void} */
        const curve = (values, name, wide) => {
            paint.strokeStyle = color(name);
            paint.lineWidth = wide;
            paint.beginPath();
            let isDown = false;
            for (let index = 0; index < values.length; index++) {
                const at = y(values[index] ?? NaN);
                // A logarithm may be infinite.
                if (Number.isFinite(at)) {
                    isDown ? paint.lineTo(x(index * this.every), at) : paint.moveTo(x(index * this.every), at);
                }
                isDown = Number.isFinite(at);
            }
            paint.stroke();
        };
        const of = (/** @type {number} */ place) => Array.from(this.points, (five) => five?.[place]);
        if (!this.isSingle) {
            paint.fillStyle = color("--accent");
            paint.globalAlpha = 0.22;
            // A logarithm has no place for 0: below all others.
            const edge = (/** @type {number} */ index, /** @type {number} */ place) => {
                const at = y(this.points[index]?.[place] ?? NaN);
                return Number.isFinite(at) ? at : 1e4;
            };
            for (const [from, to] of this.runs()) {
                paint.beginPath();
                for (let index = from; index <= to; index++) {
                    paint.lineTo(x(index * this.every), edge(index, 1));
                }
                for (let index = to; index >= from; index--) {
                    paint.lineTo(x(index * this.every), edge(index, 3));
                }
                paint.fill();
            }
            paint.globalAlpha = 1;
            curve(of(0), "--soft", 0.7);
            curve(of(4), "--soft", 0.7);
        }
        curve(of(2), "--accent", 1.8);
        if (!this.isSingle) {
            this.robots().forEach(({ robot, color: name }) => curve(this.own.get(robot) ?? [], name, 1.6));
        }
        paint.lineWidth = 1;
    }

    // Returns the first and the last index of each stretch of points that are known.
    runs() {
        /** @type {[number, number][]} */
        const runs = [];
        for (let index = 0; index < this.points.length; index++) {
            const last = runs[runs.length - 1];
            if (!Number.isFinite(this.points[index]?.[2])) {
                continue;
            }
            if (last && last[1] === index - 1) {
                last[1] = index;
            } else {
                runs.push([index, index]);
            }
        }
        return runs;
    }

    // Clears the canvas, whose pixels are those of the screen.
    prepare() {
        const { canvas } = this;
        const ratio = globalThis.devicePixelRatio || 1;
        const [width, height] = [canvas.clientWidth, canvas.clientHeight];
        const [across, down] = [Math.round(width * ratio), Math.round(height * ratio)];
        // Another size costs a new canvas, even if it is the same.
        if (canvas.width !== across || canvas.height !== down) {
            [canvas.width, canvas.height] = [across, down];
        }
        const paint = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
        paint.setTransform(ratio, 0, 0, ratio, 0, 0);
        paint.clearRect(0, 0, width, height);
        paint.lineWidth = 1;
        return { width, height, paint };
    }

    // Saves the points that are known as a table.
    save() {
        const robots = this.isSingle ? [] : this.robots().map(({ robot }) => robot);
        const columns = this.isSingle ? [texts.curveColumns.value] : texts.curveColumns.five;
        const names = robots.map((robot) => texts.robot(this.view.robots.ids[robot]));
        const lines = this.points.flatMap((five, index) => {
            const time = (index * this.every) / this.world.ticks_per_second;
            const own = robots.map((robot) => this.own.get(robot)?.[index] ?? null);
            return five ? [[time, ...(this.isSingle ? [five[2]] : five), ...own]] : [];
        });
        const cell = (/** @type {number | null} */ value) => (value === null || !Number.isFinite(value) ? "" : String(value));
        const table = [[texts.curveColumns.time, ...columns, ...names], ...lines.map((values) => values.map(cell))];
        saveTable(table.map((cells) => `${cells.join(",")}\n`).join(""), texts.curveAs(this.name));
    }
}

// Curves that wait to be drawn, one with each picture of the page: all of them take too long for one.
/** @type {Set<Curve>} */
const waiting = new Set();

const drawNext = onFrame(() => {
    const [next] = waiting;
    waiting.delete(next);
    if (waiting.size > 0) {
        drawNext();
    }
    next.draw();
});

/** @param {Curve} curve */
function drawSoon(curve) {
    waiting.add(curve);
    drawNext();
}

/**
 * @param {CanvasRenderingContext2D} paint
 * @param {[number, number][]} places
 */
function line(paint, places) {
    paint.beginPath();
    places.forEach(([x, y]) => paint.lineTo(x, y));
    paint.stroke();
}
