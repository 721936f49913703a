// The world as a drawing: SVG text, for papers.

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

// A disc with a line ahead, and its lit LED.
/**
 * @param {View} view
 * @param {number} robot
 */
function body(view, robot) {
    const { robots, colors, radii } = view;
    const [x, y] = view.placeOf(robot);
    const radius = radii[robot];
    const angle = (robots.heading[robot] / 65536) * 2 * Math.PI;
    const led = robots.led[robot];
    const lit = [led & 1, (led >> 1) & 1, (led >> 2) & 1].map((on) => on * 0.85 + 0.1);
    const edge = view.chosen === robot ? colors.chosen : colors.edge;
    return `<g><title>${robots.ids[robot]}</title>`
        + `<circle cx="${x}" cy="${y}" r="${radius * 0.94}" ${paint(view.colorOf(robot))} stroke="${rgb(edge)}" stroke-width="${radius * 0.12}"/>`
        + (led > 0 && !view.shares ? `<circle cx="${x}" cy="${y}" r="${radius * 0.62}" ${paint(lit)}/>` : "")
        + segment([0.4, 1].flatMap((share) => [x + share * radius * Math.cos(angle), y + share * radius * Math.sin(angle)]), colors.edge, radius * 0.28)
        + "</g>";
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
