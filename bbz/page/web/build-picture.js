// The picture of a thing that is chosen, dragged or drawn while the world is built.

import { radians } from "./obstacles.js";
import { SHAPES } from "./scene.js";
import { centerOf, cornersOf } from "./things.js";

/**
 * @import { ThingKind, ThingValues } from "./events"
 * @import { Handle } from "./things.js"
 * @import { View } from "./view.js"
 */

// Pixels: the radius of a handle and of its middle, and around a lamp.
const HANDLE = 6;
const HOLE = 3.5;
const LAMP = 14;

/**
 * @param {View} view
 * @param {ThingKind} kind
 * @param {ThingValues} values
 * @param {number | null} number `null` for a thing that is being drawn
 * @param {Handle[]} handles
 * @param {boolean} isGhost
 */
export function drawThing(view, kind, values, number, handles, isGhost) {
    const { scene, colors, camera } = view;
    const [at, color] = [centerOf(values), colors.chosen];
    const pixels = (/** @type {number} */ count) => count / camera.scale;
    const { from, to, radius, size, heading } = values;
    if (from && to) {
        scene.addLine(from, to, 0, color, 2.5);
    } else if (size) {
        if (isGhost) {
            scene.add(...at, size[0] / 2, size[1] / 2, radians(heading ?? 0), SHAPES.box, [...color.slice(0, 3), 0.25]);
        }
        const corners = cornersOf(values);
        corners.forEach((corner, index) => scene.addLine(corner, corners[(index + 1) % corners.length], 0, color, 1.25));
    } else {
        const ofRobot = kind === "robot" ? (view.radii[number ?? 0] ?? 0) * 1.2 : 0;
        const reach = Math.max(radius ?? ofRobot, pixels(LAMP));
        if (isGhost) {
            scene.add(...at, reach, reach, 0, SHAPES.disc, [...color.slice(0, 3), 0.25]);
        }
        scene.add(...at, reach, reach, 0, SHAPES.ring, color);
    }
    const turned = isGhost && number !== null && heading !== undefined;
    if (turned) {
        const arm = (size ? size[0] / 2 : view.radii[number] ?? 0) + pixels(22);
        scene.addLine(at, [at[0] + arm * Math.cos(radians(heading)), at[1] + arm * Math.sin(radians(heading))], 0, color, 1);
    }
    for (const handle of handles) {
        if (handle.isTurn) {
            scene.addLine(at, handle.at, 0, color, 0.75);
        }
        scene.add(...handle.at, pixels(HANDLE), pixels(HANDLE), 0, SHAPES.disc, color);
        scene.add(...handle.at, pixels(HOLE), pixels(HOLE), 0, SHAPES.disc, handle.isTurn ? color : colors.ground);
    }
}
