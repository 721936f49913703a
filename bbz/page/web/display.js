// Options of the display: a quantity as colors, messages as lines, pictures.

import { element, option, part, save } from "./element.js";
import { drawing } from "./drawing.js";
import { hide, sharesOfGroups, showGroups, showValues } from "./legend.js";
import { texts } from "./texts.js";

/**
 * @import { QuantityEvent, QuantityNames } from "./events"
 * @import { Ask, World } from "./page"
 * @import { Curves } from "./curves.js"
 * @import { View } from "./view.js"
 */

// The choice of the colors of groups. No quantity has a blank in its name.
const BY_GROUP = "by group";

export class DisplayOptions {
    // `ask(request)` asks the session for what is to be seen.
    /**
     * @param {View} view
     * @param {Curves} curves
     * @param {Ask} ask
     */
    constructor(view, curves, ask) {
        this.view = view;
        this.curves = curves;
        this.ask = ask;
        /** @type {World | null} */
        this.world = null;
        part("messages").addEventListener("change", () => this.changed());
        part("color").addEventListener("change", () => {
            this.changed();
            this.curves.follow(this.quantity);
        });
        part("trails").addEventListener("change", () => {
            view.hasTrails = part("trails").checked;
            view.sampled(true);
        });
        part("tilted").addEventListener("change", () => view.tilt(part("tilted").checked));
        part("show-labels").addEventListener("change", () => {
            view.labels.isOn = part("show-labels").checked;
            view.changed();
        });
        part("follow").addEventListener("change", () => view.follow(part("follow").checked));
        part("fit-robots").addEventListener("click", () => {
            this.stopFollowing();
            view.fitRobots();
        });
        part("picture").addEventListener("click", () => {
            // A picture has to be taken before the browser clears what was drawn.
            view.draw();
            view.canvas.toBlob((blob) => blob && save(blob, texts.pictureAs));
        });
        part("drawing").addEventListener("click", () => save(new Blob([drawing(view)], { type: "image/svg+xml" }), texts.drawingAs));
    }

    /** @param {World} world */
    begin(world) {
        this.world = world;
        const before = part("color").value;
        const entries = /** @type {[keyof QuantityNames, string[]][]} */ (Object.entries(world.quantities));
        const groups = entries.filter(([, names]) => names.length > 0);
        const byGroup = world.groups.length > 1 ? [option(texts.byGroup, BY_GROUP)] : [];
        part("color").replaceChildren(option(texts.byState, ""), ...byGroup, ...groups.map(([kind, names]) => {
            const group = element("optgroup", { label: texts.quantities[kind] });
            const isElsewhere = (/** @type {string} */ name) => kind !== "plot" && world.quantities.plot.includes(name);
            group.append(...names.filter((name) => !isElsewhere(name)).map((name) => option(name)));
            return group;
        }));
        part("color").disabled = groups.length + byGroup.length === 0;
        // The same script in another world still has it.
        part("color").value = before;
        if (part("color").selectedIndex < 0) {
            part("color").value = "";
        }
        this.changed();
    }

    // The user looks elsewhere.
    stopFollowing() {
        part("follow").checked = false;
        this.view.follow(false);
    }

    // Robots have moved.
    sampled() {
        part("tilt").hidden = !this.view.hasFliers && !this.view.camera.isTilted;
    }

    // The chosen quantity; `null`: robots have the colors of their states or groups.
    get quantity() {
        const { value } = part("color");
        return value === "" || value === BY_GROUP ? null : value;
    }

    changed() {
        const { quantity, world } = this;
        const messages = part("messages").checked;
        this.view.showMessages({ heard: [], collided: [], lost: [] });
        if (world && part("color").value === BY_GROUP) {
            const shares = sharesOfGroups(world);
            this.view.paint(world.groups.flatMap(({ count }, group) => Array(count).fill(shares[group])));
            showGroups(world);
        } else {
            this.view.paint(null);
            hide();
        }
        this.ask({ watch: { messages, quantity } });
    }

    // A single number is one of the whole swarm.
    /** @param {QuantityEvent} event */
    paint(event) {
        const { values } = event;
        const known = values.filter((value) => value !== null);
        const [least, most] = known.reduce(([low, high], value) => [Math.min(low, value), Math.max(high, value)], [Infinity, -Infinity]);
        const robots = this.view.robots.count;
        const all = values.length === robots ? values : Array(robots).fill(values[0]);
        this.view.paint(all.map((value) => (value === null ? null : (value - least) / (most - least || 1))));
        showValues(known, least, most);
    }
}
