// Things of a world that is built by hand: robots, obstacles, discs that are pushed, lamps and paint, with the values that their texts have.

import { radians } from "./obstacles.js";

/**
 * @import { ObstacleDescription, Thing, ThingKind, ThingValues } from "./events"
 * @import { Place } from "./page"
 * @import { View } from "./view.js"
 */

/**
 * A point that is dragged to change a thing; `values(place)` are those that change with the point at that place, `isTurn` if it turns the
 * thing.
 * @typedef {{ at: Place, isTurn: boolean, values: (place: Place) => ThingValues }} Handle
 */

// mm between the places of things, and degrees of a turn.
export const GRID = 10;
export const TURN = 15;

// Pixels beside a thing, or a handle, that still belong to it, and those between a robot and its handle.
const NEAR = 7;
const ARM = 22;

/** @type {ThingKind[]} */
export const KINDS = ["robot", "obstacle", "movable", "lamp", "patch"];

// The numbers of things of a kind.
/**
 * @param {View} view
 * @param {ThingKind} kind
 */
export function countOf(view, kind) {
    const { world } = view;
    if (!world) {
        return 0;
    }
    /** @type {Record<ThingKind, number>} */
    const counts = {
        robot: view.radii.length, obstacle: world.obstacles.length, movable: world.movables.length, lamp: world.lights.length, patch: world.ground.length,
    };
    return counts[kind];
}

// The form of an obstacle.
/** @param {ObstacleDescription | ThingValues} values */
export function formOf(values) {
    if ("from" in values) {
        return "wall";
    }
    return "size" in values ? "box" : "disc";
}

// The values of a thing at the start of the run, or null if there is none.
/**
 * @param {View} view
 * @param {Thing} thing
 * @returns {ThingValues | null}
 */
export function valuesOf(view, { kind, number }) {
    const { world, robots } = view;
    if (!world || number >= countOf(view, kind)) {
        return null;
    }
    if (kind === "robot") {
        // A robot that joins later has no place yet.
        return !robots.isThere[number] ? null : { at: [robots.x[number] / 10, robots.y[number] / 10], heading: degreesOf(robots.heading[number] * 360 / 65536) };
    }
    if (kind === "movable") {
        const [x, y] = robots.movables.slice(2 * number, 2 * number + 2);
        return { at: [x / 10, y / 10], radius: world.movables[number].radius };
    }
    if (kind === "lamp") {
        const { at, brightness } = world.lights[number];
        return { at, brightness };
    }
    const thing = kind === "obstacle" ? world.obstacles[number] : world.ground[number];
    const brightness = "brightness" in thing ? { brightness: thing.brightness } : {};
    if ("from" in thing) {
        return { from: thing.from, to: thing.to };
    }
    const { at } = thing;
    return "radius" in thing ? { at, radius: thing.radius, ...brightness } : { at, size: thing.size, heading: thing.heading, ...brightness };
}

// The center.
/**
 * @param {ThingValues} values
 * @returns {Place}
 */
export function centerOf({ at, from = [0, 0], to = [0, 0] }) {
    return at ?? [(from[0] + to[0]) / 2, (from[1] + to[1]) / 2];
}

// The values that move a thing.
/**
 * @param {ThingValues} values
 * @param {Place} way
 * @returns {ThingValues}
 */
export function movedBy({ at, from, to }, [x, y]) {
    /** @type {(place: Place) => Place} */
    const moved = (place) => [place[0] + x, place[1] + y];
    return from && to ? { from: moved(from), to: moved(to) } : { at: moved(at ?? [0, 0]) };
}

// The values that turn a thing, or null if it has no direction.
/**
 * @param {ThingValues} values
 * @param {number} degrees
 * @returns {ThingValues | null}
 */
export function turnedBy(values, degrees) {
    const { from, to, heading } = values;
    if (heading !== undefined) {
        return { heading: degreesOf(Math.round((heading + degrees) * 10) / 10) };
    }
    if (!from || !to) {
        return null;
    }
    const [[x, y], angle] = [centerOf(values), radians(degrees)];
    /** @type {(place: Place) => Place} */
    const turned = ([right, up]) => [
        x + (right - x) * Math.cos(angle) - (up - y) * Math.sin(angle), y + (right - x) * Math.sin(angle) + (up - y) * Math.cos(angle),
    ];
    return { from: turned(from), to: turned(to) };
}

// An angle from 0 up to 360.
/** @param {number} degrees */
function degreesOf(degrees) {
    return ((degrees % 360) + 360) % 360;
}

/** @type {(from: Place, to: Place) => number} */
const distance = (from, to) => Math.hypot(to[0] - from[0], to[1] - from[1]);

/** @type {(from: Place, to: Place) => number} */
const angleOf = (from, to) => Math.atan2(to[1] - from[1], to[0] - from[0]);

// A point in the axes of a box.
/**
 * @param {ThingValues} values
 * @param {Place} place
 * @returns {Place}
 */
function inBox({ at = [0, 0], heading = 0 }, place) {
    const [right, up, angle] = [place[0] - at[0], place[1] - at[1], radians(heading)];
    return [right * Math.cos(angle) + up * Math.sin(angle), up * Math.cos(angle) - right * Math.sin(angle)];
}

/**
 * @param {ThingValues} values
 * @param {Place} place in the axes of the box
 * @returns {Place}
 */
function fromBox({ at = [0, 0], heading = 0 }, [along, across]) {
    const angle = radians(heading);
    return [at[0] + along * Math.cos(angle) - across * Math.sin(angle), at[1] + along * Math.sin(angle) + across * Math.cos(angle)];
}

// The corners of a box.
/** @param {ThingValues} values */
export function cornersOf(values) {
    const [width, height] = (values.size ?? [0, 0]).map((side) => side / 2);
    /** @type {Place[]} */
    const corners = [[width, height], [-width, height], [-width, -height], [width, -height]];
    return corners.map((corner) => fromBox(values, corner));
}

// The thing at a place: what lies above comes first.
/**
 * @param {View} view
 * @param {Place} place
 * @returns {Thing | null}
 */
export function thingAt(view, place) {
    const [robot, lamp, slack] = [view.robotAt(place), view.lampAt(place), NEAR / view.camera.scale];
    if (robot !== null) {
        return { kind: "robot", number: robot };
    }
    if (lamp !== null) {
        return { kind: "lamp", number: lamp };
    }
    for (const kind of /** @type {ThingKind[]} */ (["obstacle", "movable", "patch"])) {
        for (let number = countOf(view, kind) - 1; number >= 0; number--) {
            const values = valuesOf(view, { kind, number });
            if (values && isIn(values, place, kind === "patch" ? 0 : slack)) {
                return { kind, number };
            }
        }
    }
    return null;
}

/**
 * @param {ThingValues} values
 * @param {Place} place
 * @param {number} slack
 */
function isIn(values, place, slack) {
    const { from, to, radius, size } = values;
    if (from && to) {
        const [along, length] = [[to[0] - from[0], to[1] - from[1]], distance(from, to)];
        const share = length > 0 ? ((place[0] - from[0]) * along[0] + (place[1] - from[1]) * along[1]) / length ** 2 : 0;
        const inside = Math.max(0, Math.min(1, share));
        return distance([from[0] + inside * along[0], from[1] + inside * along[1]], place) <= slack;
    }
    if (radius !== undefined) {
        return distance(centerOf(values), place) <= radius + slack;
    }
    const [along, across] = inBox(values, place).map(Math.abs);
    const [width, height] = size ?? [0, 0];
    return along <= width / 2 + slack && across <= height / 2 + slack;
}

// The points that change a thing when they are dragged. `snap` rounds a length.
/**
 * @param {View} view
 * @param {Thing} thing
 * @param {ThingValues} values
 * @param {(length: number) => number} snap
 * @returns {Handle[]}
 */
export function handlesOf(view, { kind, number }, values, snap) {
    const { from, to, radius, size, heading } = values;
    const at = centerOf(values);
    if (from && to) {
        return [
            { at: from, isTurn: false, values: (place) => ({ from: place }) },
            { at: to, isTurn: false, values: (place) => ({ to: place }) },
        ];
    }
    /** @type {Handle[]} */
    const handles = [];
    if (heading !== undefined) {
        const arm = (size ? size[0] / 2 : view.radii[number] ?? 0) + ARM / view.camera.scale;
        const angle = radians(heading);
        handles.push({
            at: [at[0] + arm * Math.cos(angle), at[1] + arm * Math.sin(angle)], isTurn: true,
            values: (place) => ({ heading: degreesOf((angleOf(at, place) * 180) / Math.PI) }),
        });
    }
    if (size) {
        handles.push({
            at: cornersOf(values)[0], isTurn: false,
            values: (place) => {
                const [along, across] = inBox(values, place).map((half) => Math.max(1, snap(2 * Math.abs(half))));
                return { size: [along, across] };
            },
        });
    } else if (radius !== undefined && kind !== "robot") {
        handles.push({ at: [at[0] + radius, at[1]], isTurn: false, values: (place) => ({ radius: Math.max(1, snap(distance(at, place))) }) });
    }
    return handles;
}

// The handle at a place.
/**
 * @param {View} view
 * @param {Handle[]} handles
 * @param {Place} place
 */
export function handleAt(view, handles, place) {
    return handles.find(({ at }) => distance(at, place) * view.camera.scale <= NEAR + 3) ?? null;
}

// The free place for a robot that is nearest to another one.
/**
 * @param {View} view
 * @param {Place} middle
 * @param {number} radius
 * @returns {Place}
 */
export function freePlace(view, [x, y], radius) {
    const { robots, radii, world } = view;
    const [right, up] = (world?.size ?? [0, 0]).map((side) => Math.max(0, side / 2 - radius));
    /** @type {(place: Place) => boolean} */
    const isFree = (place) => Math.abs(place[0]) <= right && Math.abs(place[1]) <= up
        && radii.every((other, robot) => distance(place, [robots.x[robot] / 10, robots.y[robot] / 10]) >= other + radius + 1);
    const step = 10 * Math.ceil((2 * radius + 2) / 10);
    for (let ring = 0; ring < 60; ring++) {
        for (let side = 0; side < Math.max(1, 8 * ring); side++) {
            const angle = (2 * Math.PI * side) / Math.max(1, 8 * ring);
            /** @type {Place} */
            const place = [Math.round((x + ring * step * Math.cos(angle)) / 10) * 10, Math.round((y + ring * step * Math.sin(angle)) / 10) * 10];
            if (isFree(place)) {
                return place;
            }
        }
    }
    return [x, y];
}
