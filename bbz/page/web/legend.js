// The colors of the world: those of a quantity, with a histogram of its values, or those of the groups.

import { element, part, printable, write } from "./element.js";
import { texts } from "./texts.js";

/**
 * @import { World } from "./page"
 */

// Bars of a histogram, which are wide enough to point at.
const BARS = 16;

// Returns the part of the range from 0 to 1 at which each group has its color.
/** @param {World} world */
export function sharesOfGroups({ groups }) {
    return groups.map((_, group) => group / Math.max(1, groups.length - 1));
}

// Returns the number of values in each of equal parts of a range.
/**
 * @param {number[]} values
 * @param {number} least
 * @param {number} most
 */
function counts(values, least, most) {
    const bars = Array(BARS).fill(0);
    for (const value of values) {
        bars[Math.min(BARS - 1, Math.floor((BARS * (value - least)) / (most - least)))] += 1;
    }
    return bars;
}

// Shows the colors of values, and how many robots have which. A single value is one of the whole swarm.
/**
 * @param {number[]} values
 * @param {number} least
 * @param {number} most
 */
export function showValues(values, least, most) {
    part("legend").hidden = values.length === 0;
    part("group-legend").hidden = true;
    write(part("least"), texts.number(least));
    write(part("most"), texts.number(most));
    const histogram = part("histogram");
    histogram.hidden = !(most > least);
    if (histogram.hidden) {
        return;
    }
    const bars = counts(values, least, most);
    const highest = bars.reduce((one, other) => Math.max(one, other));
    const limit = (/** @type {number} */ bar) => least + (bar * (most - least)) / BARS;
    while (histogram.children.length < BARS) {
        histogram.append(element("b"));
    }
    bars.forEach((count, bar) => {
        const shown = /** @type {HTMLElement} */ (histogram.children[bar]);
        shown.style.height = `${(100 * count) / highest}%`;
        // A bar for one robot of many can be seen, too.
        shown.style.minHeight = count > 0 ? "1px" : "0";
        shown.title = printable(texts.bar(limit(bar), limit(bar + 1), texts.countOf(count, "")));
    });
    histogram.setAttribute("aria-label", printable(texts.histogram(bars)));
}

// Shows the color of each group.
/** @param {World} world */
export function showGroups(world) {
    const shares = sharesOfGroups(world);
    part("legend").hidden = true;
    part("group-legend").hidden = false;
    part("group-legend").replaceChildren(...world.groups.map(({ name, robot }, group) => {
        const color = element("i");
        color.style.backgroundPosition = `${100 * shares[group]}%`;
        return element("span", {}, color, printable(name ?? robot ?? ""));
    }));
}

export function hide() {
    part("legend").hidden = true;
    part("group-legend").hidden = true;
}
