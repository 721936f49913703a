// The boxes that robots do not leave in flight: dashed lines, which obstacles do not have.

// Dashes along the longer side of the world.
const DASHES = 60;

/**
 * @import { FenceDescription } from "./events"
 * @import { Color, Place, SpacePlace } from "./page"
 * @import { Scene } from "./scene.js"
 */

export class Fences {
    /** @param {Scene} scene */
    constructor(scene) {
        this.scene = scene;
        this.ground = scene.makeLines();
        this.above = scene.makeLines();
    }

    // `size` is that of the world in mm. Fences of several groups may be equal.
    /**
     * @param {FenceDescription[]} fences
     * @param {Place} size
     */
    set(fences, size) {
        const dash = Math.max(...size) / DASHES;
        const edges = fences.map((fence) => edgesOf(fence, size));
        const set = (/** @type {"ground" | "above"} */ lines, /** @type {SpacePlace[][]} */ pairs) => {
            this.scene.setLines(this[lines], Float32Array.from(pairs.flatMap((pair) => dashes(pair, dash)).flat(2), (mm) => 10 * mm));
        };
        set("ground", edges.flatMap(({ ground }) => ground));
        set("above", edges.flatMap(({ above }) => above));
    }

    /** @param {Color} color */
    draw(color) {
        this.scene.drawLines(this.ground, color, 1.2);
        if (this.scene.camera.isTilted) {
            this.scene.drawLines(this.above, color, 1.2);
        }
    }
}

// The edges on the ground, and those above it. A side without a limit has none, and the others end with the world there.
/**
 * @param {FenceDescription} fence
 * @param {Place} size
 */
export function edgesOf({ least, most, height }, size) {
    const [left, bottom] = least.map((mm, axis) => mm ?? -size[axis] / 2);
    const [right, top] = most.map((mm, axis) => mm ?? size[axis] / 2);
    /** @type {[Place, Place, boolean][]} */
    const sides = [
        [[left, bottom], [right, bottom], least[1] !== null], [[right, bottom], [right, top], most[0] !== null],
        [[right, top], [left, top], most[1] !== null], [[left, top], [left, bottom], least[0] !== null],
    ];
    const walls = sides.filter(([, , isThere]) => isThere);
    const at = (/** @type {number} */ z) => walls.map(([from, to]) => /** @type {SpacePlace[]} */ ([[...from, z], [...to, z]]));
    const posts = height === null ? [] : walls.flatMap(([from, to]) => [from, to]).map((post) => /** @type {SpacePlace[]} */ ([[...post, 0], [...post, height]]));
    return { ground: at(0), above: height === null ? [] : [...at(height), ...posts] };
}

/**
 * @param {SpacePlace[]} line
 * @param {number} dash
 * @returns {SpacePlace[][]}
 */
function dashes([from, to], dash) {
    const length = Math.hypot(...from.map((mm, axis) => to[axis] - mm));
    // An odd number of parts begins and ends with a dash.
    const parts = 2 * Math.floor(length / dash / 2) + 1;
    const point = (/** @type {number} */ part) => /** @type {SpacePlace} */ (from.map((mm, axis) => mm + ((to[axis] - mm) * part) / parts));
    return Array.from({ length: (parts + 1) / 2 }, (_, index) => [point(2 * index), point(2 * index + 1)]);
}
