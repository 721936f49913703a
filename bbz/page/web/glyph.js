// Pictures of robots and LEDs in texts.

import { element } from "./element.js";
import { texts } from "./texts.js";

/** @import { GlyphName } from "./events" */

const SVG = "http://www.w3.org/2000/svg";

// The glyph of a kind of robots, which index.html has.
/** @param {GlyphName} glyph */
export function icon(glyph) {
    const [svg, use] = ["svg", "use"].map((name) => document.createElementNS(SVG, name));
    svg.setAttribute("class", "glyph");
    svg.setAttribute("aria-hidden", "true");
    use.setAttribute("href", `#g-${glyph}`);
    svg.append(use);
    return svg;
}

// An LED with the letter of its color, which is not only seen by color. A text with the color's name stands next to it.
/** @param {number} color */
export function led(color) {
    return element("span", { class: `led c${color}`, "aria-hidden": "true" }, texts.colorLetters[color]);
}
