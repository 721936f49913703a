// The panels with curves: the session sends their points, from the beginning of the run up to now.

import { Curve } from "./curve.js";
import { element, option, part, write } from "./element.js";
import { texts } from "./texts.js";

// The session has no more for one page (live/src/series.rs).
const CURVES_MAX = 12;

// Milliseconds that a computation may take before its progress is shown, which moves the world.
const UNSEEN = 400;

/**
 * @import { QuantityNames, SeriesCutEvent, SeriesEvent, SeriesProgressEvent } from "./events"
 * @import { Ask, World } from "./page"
 * @import { View } from "./view.js"
 */

export class Curves {
    // `ask(request)` asks the session for points, `onGo(tick)` when the user clicks on a curve.
    /**
     * @param {View} view
     * @param {Ask} ask
     * @param {(tick: number) => void} onGo
     */
    constructor(view, ask, onGo) {
        this.view = view;
        this.ask = ask;
        this.onGo = onGo;
        /** @type {World | null} */
        this.world = null;
        /** @type {Map<string, Curve>} */
        this.curves = new Map();
        // The curve that follows "Color by".
        /** @type {string | null} */
        this.colored = null;
        // The world that was shown last, and what was asked for last.
        this.known = "";
        this.asked = "";
        this.percent = 100;
        this.isStopped = false;
        // The timer that shows the progress.
        this.showing = 0;
        part("add-curve").addEventListener("change", () => {
            this.open(part("add-curve").value);
            part("add-curve").value = "";
        });
        part("stop-curves").addEventListener("click", () => this.stop());
        part("go-on-curves").addEventListener("click", () => {
            this.asked = "";
            this.changed();
        });
        matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.redraw());
    }

    /** @param {World} world */
    begin(world) {
        this.world = world;
        const known = JSON.stringify([world.scripts?.file, world.quantities.plot]);
        const isOther = known !== this.known;
        this.known = known;
        const names = Object.values(world.quantities).flat();
        const kept = isOther ? world.quantities.plot : [...this.curves.keys()].filter((name) => names.includes(name));
        const before = this.curves;
        this.curves = new Map();
        for (const name of kept.slice(0, CURVES_MAX)) {
            const curve = this.create(name, world);
            curve.choose(before.get(name)?.kind ?? "all");
            this.curves.set(name, curve);
        }
        if (isOther || !names.includes(this.colored ?? "")) {
            this.colored = null;
        }
        part("curve-list").replaceChildren(...[...this.curves.values()].map(({ panel }) => panel));
        this.progress({ percent: 100, problem: null });
        this.learn(world);
        // The session may be another one, or this page may have come back.
        this.asked = "";
        this.changed();
    }

    // Fills the list of quantities.
    /** @param {World} world */
    learn(world) {
        const entries = /** @type {[keyof QuantityNames, string[]][]} */ (Object.entries(world.quantities));
        const groups = entries.map(([kind, names]) => {
            const shown = names.filter((name) => !this.curves.has(name) && (kind === "plot" || !world.quantities.plot.includes(name)));
            const group = element("optgroup", { label: texts.quantities[kind] });
            group.append(...shown.map((name) => option(name)));
            return group;
        });
        const filled = groups.filter((group) => group.childElementCount > 0);
        part("add-curve").replaceChildren(option(texts.addCurve, ""), ...filled);
        part("add-curve").disabled = filled.length === 0 || this.curves.size >= CURVES_MAX;
        part("curves").hidden = this.curves.size === 0;
    }

    /**
     * @param {string} name
     * @param {World} world
     */
    create(name, world) {
        return new Curve(name, this.view, world, {
            onClose: () => this.close(name),
            onCursor: (tick) => this.curves.forEach((curve) => curve.point(tick)),
            onGo: (tick) => this.onGo(tick),
        });
    }

    /** @param {string} name */
    open(name) {
        if (!this.world || this.curves.has(name) || this.curves.size >= CURVES_MAX) {
            return;
        }
        const curve = this.create(name, this.world);
        this.curves.set(name, curve);
        part("curve-list").append(curve.panel);
        curve.show(this.view.robots.tick);
        curve.panel.scrollIntoView({ block: "nearest" });
        this.learn(this.world);
        this.changed();
    }

    /** @param {string} name */
    close(name) {
        this.curves.get(name)?.panel.remove();
        this.curves.delete(name);
        if (this.world) {
            this.learn(this.world);
        }
        this.changed();
        // The focus was in the panel.
        part("add-curve").focus();
    }

    // Shows the quantity by which robots are colored, in place of the one before. `null` leaves that one.
    /** @param {string | null} name */
    follow(name) {
        if (name === null || name === this.colored) {
            return;
        }
        const before = this.colored;
        this.colored = this.curves.has(name) ? null : name;
        if (before !== null) {
            this.curves.get(before)?.panel.remove();
            this.curves.delete(before);
        }
        this.open(name);
    }

    // Asks for what the panels show, if it is something else than before.
    changed() {
        const { chosen, compared } = this.view;
        const robots = [...new Set([chosen, ...compared].flatMap((robot) => (robot === null ? [] : [robot])))];
        const quantities = [...this.curves.keys()];
        const asked = JSON.stringify([quantities, robots]);
        if (asked !== this.asked) {
            const isFirst = this.asked === "";
            this.asked = asked;
            this.isStopped = false;
            // A session without curves has nothing to send.
            if (!isFirst || quantities.length > 0) {
                this.ask({ series: { quantities, robots } });
            }
        }
        this.redraw();
    }

    redraw() {
        this.curves.forEach((curve) => curve.changed());
    }

    // The world shows another tick.
    /** @param {number} tick */
    show(tick) {
        this.curves.forEach((curve) => curve.show(tick));
    }

    /** @param {SeriesEvent} event */
    take(event) {
        this.curves.get(event.name)?.take(event);
    }

    /** @param {SeriesCutEvent} event */
    cut({ tick }) {
        this.curves.forEach((curve) => curve.cut(tick));
    }

    /** @param {SeriesProgressEvent} event */
    progress({ percent, problem }) {
        this.percent = percent;
        if (percent === 100) {
            clearTimeout(this.showing);
            this.showing = 0;
            part("curve-bar").hidden = true;
        } else if (this.showing === 0) {
            this.showing = setTimeout(() => {
                part("curve-bar").hidden = false;
            }, UNSEEN);
        }
        const text = problem ? texts.pastUnknown(problem) : this.isStopped ? texts.pastStopped(percent) : texts.computingPast(percent);
        write(part("curve-progress"), text);
        part("stop-curves").hidden = problem !== null || this.isStopped;
        part("go-on-curves").hidden = problem !== null || !this.isStopped;
    }

    stop() {
        this.ask("stop_series");
        this.isStopped = true;
        this.progress({ percent: this.percent, problem: null });
        part("go-on-curves").focus();
    }
}
