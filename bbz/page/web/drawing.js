// The world as a drawing: SVG text, for papers.

import { PARTS } from "./bodies.js";
import { edgesOf } from "./fence.js";
import { placedMovables, RING } from "./obstacles.js";
import { groundColor, paintColor } from "./paint.js";

// mm around the world.
const MARGIN = 30;

/**
 * @import { ObstacleDescription, PatchDescription } from "./events"
 * @import { Color, Place, SpacePlace, World } from "./page"
 * @import { View } from "./view.js"
 */

// `view` has the world, the robots and what is to be seen of them.
/** @param {View} view */
export function drawing(view) {
    const { world, robots, colors } = view;
    if (!world) {
        return "";
    }
    const [width, height] = world.size;
    const parts = [`<rect x="${-width / 2}" y="${-height / 2}" width="${width}" height="${height}" ${paint(groundColor(world, colors))} stroke="${rgb(colors.obstacle)}" stroke-width="2"/>`];
    if (world.ground.length > 0) {
        // Paint may reach beyond the world.
        parts.push(`<clipPath id="world"><rect x="${-width / 2}" y="${-height / 2}" width="${width}" height="${height}"/></clipPath>`);
        parts.push(`<g clip-path="url(#world)">`, ...world.ground.map((patch) => shape(patch, paintColor(patch, colors))), "</g>");
    }
    for (const { at: [x, y], brightness } of view.lights) {
        parts.push(`<circle cx="${x}" cy="${y}" r="14" ${paint(colors.light)} opacity="${Math.max(0.3, Math.min(1, brightness / 1023))}"/>`);
    }
    parts.push(...world.obstacles.map((obstacle) => outline(obstacle, colors.obstacle)));
    for (const { ground } of world.groups.flatMap(({ fence }) => (fence === null ? [] : edgesOf(fence, world.size)))) {
        const line = (/** @type {SpacePlace[]} */ [[x, y], [toX, toY]]) => `<line x1="${x}" y1="${y}" x2="${toX}" y2="${toY}" stroke="${rgb(colors.fence)}" stroke-width="4" stroke-dasharray="40"/>`;
        parts.push(...ground.map(line));
    }
    for (const disc of placedMovables(world.movables, robots)) {
        const [x, y] = disc.at;
        parts.push(shape(disc, colors.movable), `<circle cx="${x}" cy="${y}" r="${RING * disc.radius}" fill="none" stroke="${rgb(groundColor(world, colors))}" stroke-width="${disc.radius / 10}"/>`);
    }
    for (const { ends } of view.trails.ways) {
        for (let at = 0; at < ends.length; at += 6) {
            const [x, y, , toX, toY] = ends.subarray(at, at + 6).map((tenths) => tenths / 10);
            parts.push(segment([x, y, toX, toY], colors.states[0], 1));
        }
    }
    if (view.chosen !== null) {
        const from = view.placeOf(view.chosen);
        view.neighbors.forEach((robot) => parts.push(segment([...from, ...view.placeOf(robot)], colors.link, 2)));
    }
    for (const { robot, displaced, seen_as: other } of view.poseErrors) {
        const [x, y] = view.placeOf(other ?? robot).map((at, axis) => at + displaced[axis]);
        parts.push(segment([...view.placeOf(robot), x, y], colors.states[3], 2), `<circle cx="${x}" cy="${y}" r="${view.radii[robot]}" fill="none" stroke="${rgb(colors.states[3])}" stroke-width="2"/>`);
    }
    for (let robot = 0; robot < robots.count; robot++) {
        if (robots.isThere[robot]) {
            parts.push(body(view, robot));
        }
    }
    const box = [-width / 2 - MARGIN, -height / 2 - MARGIN, width + 2 * MARGIN, height + 3 * MARGIN];
    return `<svg xmlns="http://www.w3.org/2000/svg" viewBox="${box.join(" ")}">\n<g transform="scale(1,-1)">\n${parts.join("\n")}\n</g>\n${bar(world)}\n</svg>\n`;
}

/**
 * @param {ObstacleDescription} obstacle
 * @param {Color} color
 */
function outline(obstacle, color) {
    if ("from" in obstacle) {
        return segment([...obstacle.from, ...obstacle.to], color, 4);
    }
    return shape(obstacle, color);
}

/**
 * @param {Exclude<ObstacleDescription, { from: Place }> | PatchDescription | { at: Place, radius: number }} outline
 * @param {Color} color
 */
function shape(outline, color) {
    const [x, y] = outline.at;
    if ("radius" in outline) {
        return `<circle cx="${x}" cy="${y}" r="${outline.radius}" ${paint(color)}/>`;
    }
    const { size: [width, height], heading } = outline;
    const turn = heading === 0 ? "" : ` transform="rotate(${heading} ${x} ${y})"`;
    return `<rect x="${x - width / 2}" y="${y - height / 2}" width="${width}" height="${height}"${turn} ${paint(color)}/>`;
}

// The glyph of a robot, and its lit LED.
/**
 * @param {View} view
 * @param {number} robot
 */
function body(view, robot) {
    const { robots, colors, radii } = view;
    const [x, y] = view.placeOf(robot);
    const radius = radii[robot];
    const degrees = (robots.heading[robot] / 65536) * 360;
    const led = robots.led[robot];
    const lit = [led & 1, (led >> 1) & 1, (led >> 2) & 1].map((on) => on * 0.85 + 0.1);
    const edge = view.chosen === robot ? colors.chosen : view.edge;
    const limb = view.chosen === robot ? colors.chosen : colors.limb;
    const color = view.colorOf(robot);
    const disc = (/** @type {number} */ share, /** @type {Color} */ fill, rim = 0) => `<circle cx="${x}" cy="${y}" r="${share * radius}" ${paint(fill)}`
        + (rim > 0 ? ` stroke="${rgb(edge)}" stroke-width="${radius * rim}"/>` : "/>");
    const lamp = (/** @type {number} */ share) => (led > 0 && !view.shares ? disc(share, lit) : "");
    // Its parts, in radii with x ahead.
    const parts = (/** @type {string[]} */ ...inside) => `<g transform="translate(${x} ${y}) rotate(${degrees.toFixed(1)}) scale(${radius})">${inside.join("")}</g>`;
    const notch = `<rect x="${PARTS.notch[0]}" y="${-PARTS.notch[1]}" width="${0.98 - PARTS.notch[0]}" height="${2 * PARTS.notch[1]}" ${paint(colors.edge)}/>`;
    const dot = (/** @type {number} */ atX, /** @type {number} */ atY, /** @type {number} */ size) => `<circle cx="${atX.toFixed(3)}" cy="${atY.toFixed(3)}" r="${size}" ${paint(colors.limb)}/>`;
    const glyphs = {
        disc: () => disc(0.94, color, 0.12) + lamp(PARTS.lamp) + parts(notch),
        legs: () => disc(PARTS.rim - 0.06, color, 0.12) + lamp(PARTS.lamp - 0.06)
            + parts(...PARTS.legs.map((angle, leg) => {
                const [away, size] = PARTS.leg[Math.min(leg, 1)];
                return dot(away * Math.cos(angle), away * Math.sin(angle), size);
            })),
        wheels: () => {
            const [away, long, wide] = PARTS.wheel;
            const wheel = (/** @type {number} */ side) => `<rect x="${-long}" y="${side * away - wide}" width="${2 * long}" height="${2 * wide}" rx="0.08" ${paint(colors.limb)}/>`;
            return disc(PARTS.rim - 0.05, color, 0.1) + lamp(PARTS.lamp) + parts(notch, wheel(1), wheel(-1));
        },
        rotors: () => {
            const [away, size] = PARTS.rotor;
            const corners = [[1, 1], [1, -1], [-1, -1], [-1, 1]].map((corner) => corner.map((side) => side * away));
            return parts(...corners.map(([atX, atY]) => `<circle cx="${atX}" cy="${atY}" r="${size - 0.05}" ${paint(color)} fill-opacity="0.65" stroke="${rgb(color)}" stroke-width="0.1"/>`),
                ...corners.slice(0, 2).map(([atX, atY]) => `<line x1="${atX}" y1="${atY}" x2="${-atX}" y2="${-atY}" stroke="${rgb(limb)}" stroke-width="${2 * PARTS.arm}"/>`),
                `<path d="M0.2 0.26L0.72 0L0.2 -0.26Z" ${paint(limb)}/>`)
                + disc(PARTS.hub - 0.05, color, 0.1) + lamp(PARTS.hub - 0.1);
        },
    };
    return `<g><title>${robots.ids[robot]}</title>${glyphs[view.glyphs[robot]]()}</g>`;
}

/**
 * @param {number[]} ends
 * @param {Color} color
 * @param {number} wide
 */
function segment([x, y, toX, toY], color, wide) {
    return `<line x1="${x.toFixed(1)}" y1="${y.toFixed(1)}" x2="${toX.toFixed(1)}" y2="${toY.toFixed(1)}" stroke="${rgb(color)}" stroke-width="${wide}"/>`;
}

// A bar of 1, 2 or 5 times a power of ten mm: at most a quarter of the world.
/** @param {World} world */
function bar({ size: [width, height] }) {
    const power = 10 ** Math.floor(Math.log10(width / 4));
    const long = [5, 2].map((times) => times * power).find((one) => one <= width / 4) ?? power;
    const y = height / 2 + 1.2 * MARGIN;
    return `<line x1="${-width / 2}" y1="${y}" x2="${long - width / 2}" y2="${y}" stroke="#808080" stroke-width="4"/>`
        + `<text x="${long - width / 2 + 10}" y="${y + 8}" font-family="sans-serif" font-size="24" fill="#808080">${long} mm</text>`;
}

const rgb = (/** @type {Color} */ color) => `rgb(${color.slice(0, 3).map((share) => Math.round(255 * share)).join(",")})`;
const paint = (/** @type {Color} */ color) => `fill="${rgb(color)}"`;
