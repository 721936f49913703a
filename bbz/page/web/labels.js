// Letters on a canvas over the world: the ids of robots, and the colors of their LEDs, where bodies have room for them.

import { BODY_HEIGHT } from "./bodies.js";
import { FAILED } from "./recording.js";
import { texts } from "./texts.js";

/**
 * @import { View } from "./view.js"
 */

// Pixels of a radius from which a body has room for a letter, and for its id next to it.
const LETTER_PIXELS_MIN = 9;
const ID_PIXELS_MIN = 9;
// Of more robots in sight, labels would hide the world.
const LABELS_MAX = 300;

export class Labels {
    /** @param {HTMLCanvasElement} canvas */
    constructor(canvas) {
        this.canvas = canvas;
        this.context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
        this.isOn = true;
        this.isEmpty = true;
    }

    // Draws the labels of a picture of the world.
    /** @param {View} view */
    draw(view) {
        const { canvas, context } = this;
        const ratio = globalThis.devicePixelRatio || 1;
        const [width, height] = [view.scene.width, view.scene.height].map((side) => Math.round(side * ratio));
        if (canvas.width !== width || canvas.height !== height) {
            [canvas.width, canvas.height] = [width, height];
        } else if (!this.isEmpty) {
            context.clearRect(0, 0, width, height);
        }
        this.isEmpty = true;
        const isRoom = view.scene.largest * view.camera.scale >= Math.min(LETTER_PIXELS_MIN, ID_PIXELS_MIN);
        const robots = this.isOn && isRoom ? this.seen(view) : [];
        if (robots.length === 0) {
            return;
        }
        this.isEmpty = false;
        context.setTransform(ratio, 0, 0, ratio, 0, 0);
        context.textAlign = "center";
        context.textBaseline = "middle";
        for (const { robot, x, y, radius } of robots) {
            const isTilted = view.camera.isTilted;
            const led = view.robots.led[robot];
            if (radius >= LETTER_PIXELS_MIN && led > 0 && !view.shares && view.robots.state[robot] !== FAILED && !isTilted) {
                const isHub = view.glyphs[robot] === "rotors";
                context.font = `700 ${Math.min(15, radius * (isHub ? 0.42 : 0.78)).toFixed(1)}px system-ui, sans-serif`;
                // Blue alone is so dark that white is read better on it.
                context.fillStyle = led === 4 ? "#ffffff" : "#10161c";
                context.fillText(texts.colorLetters[led], x, y + 0.5);
            }
            if (radius >= ID_PIXELS_MIN && robot !== view.chosen) {
                const size = Math.max(10, Math.min(13, radius * 0.7));
                context.font = `500 ${size.toFixed(1)}px system-ui, sans-serif`;
                const at = /** @type {[number, number]} */ ([x + radius * 0.72 + size * 0.4, y - radius * 0.72 - size * 0.35]);
                context.lineWidth = 3;
                context.lineJoin = "round";
                context.strokeStyle = view.colors.halo;
                context.fillStyle = view.colors.text;
                context.strokeText(String(view.robots.ids[robot]), ...at);
                context.fillText(String(view.robots.ids[robot]), ...at);
            }
        }
        context.setTransform(1, 0, 0, 1, 0, 0);
    }

    // Robots in the picture that are large enough, with their places in pixels; none if there are too many.
    /** @param {View} view */
    seen(view) {
        const { camera, scene, robots, radii } = view;
        const found = [];
        for (let robot = 0; robot < robots.count; robot++) {
            const radius = radii[robot] * camera.scale;
            if (radius < Math.min(LETTER_PIXELS_MIN, ID_PIXELS_MIN) || !robots.isThere[robot]) {
                continue;
            }
            const [right, up] = camera.project(...view.spaceOf(robot));
            // In 3-D a body stands up.
            const top = view.glyphs[robot] === "rotors" ? 0 : BODY_HEIGHT * radius * camera.height;
            const [x, y] = [scene.width / 2 + right, scene.height / 2 - up - top];
            if (x > -radius && y > -radius && x < scene.width + radius && y < scene.height + radius) {
                if (found.length === LABELS_MAX) {
                    return [];
                }
                found.push({ robot, x, y, radius });
            }
        }
        return found;
    }
}
