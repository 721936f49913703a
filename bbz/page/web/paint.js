// The painted ground.

import { radians } from "./obstacles.js";
import { SHAPES } from "./scene.js";

/**
 * @import { PatchDescription } from "./events"
 * @import { Color, World } from "./page"
 * @import { Scene } from "./scene.js"
 */

/** @typedef {{ ground: Color, black: Color, white: Color, outside: Color }} GroundColors */

/**
 * @param {Scene} scene
 * @param {World} world
 * @param {GroundColors} colors
 */
export function drawPaint(scene, { size, ground }, colors) {
    for (const patch of ground) {
        const half = "radius" in patch ? [patch.radius, patch.radius] : patch.size.map((side) => side / 2);
        const [angle, shape] = "radius" in patch ? [0, SHAPES.disc] : [radians(patch.heading), SHAPES.box];
        scene.add(...patch.at, half[0], half[1], angle, shape, paintColor(patch, colors));
    }
    if (ground.length > 0 && scene.camera.isTilted) {
        // From above, paint ends with the world; in 3-D the surroundings hide what reaches beyond.
        const reach = Math.max(...ground.map((patch) => ("radius" in patch ? patch.radius : Math.hypot(...patch.size))));
        const [width, height] = size.map((side) => side / 2);
        for (const side of [-1, 1]) {
            scene.add(side * (width + reach), 0, reach, height + 2 * reach, 0, SHAPES.box, colors.outside);
            scene.add(0, side * (height + reach), width + 2 * reach, reach, 0, SHAPES.box, colors.outside);
        }
    }
}

/**
 * @param {PatchDescription} patch
 * @param {GroundColors} colors
 */
export function paintColor({ brightness }, { black, white }) {
    return black.map((dark, part) => dark + (white[part] - dark) * brightness);
}

// Ground with paint on it is as white as the paint.
/**
 * @param {World} world
 * @param {GroundColors} colors
 */
export function groundColor({ ground }, colors) {
    return ground.length > 0 ? colors.white : colors.ground;
}
