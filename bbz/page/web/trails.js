// The trails of all robots.
//
// They are painted into a layer of their own, each sample over those before, which fade. So a picture costs the lines of its new
// sample alone, for two thousand robots as well; only after the camera has moved are all lines painted again.

// Samples after which a part of a trail is gone.
const SAMPLES = 40;
// Lines that are painted at once when the camera moves, and that are kept.
const LINES_MAX = 120000;

/**
 * @import { Color, Lines } from "./page"
 * @import { Robots } from "./recording.js"
 * @import { Scene } from "./scene.js"
 */

export class Trails {
    /** @param {Scene} scene */
    constructor(scene) {
        this.scene = scene;
        this.layer = scene.makeLayer();
        // The last sample: x, y and z of each robot.
        /** @type {Int32Array[] | null} */
        this.last = null;
        // The lines from each sample to the next, with their ends: x, y and z of both in tenths of mm.
        /** @type {{ lines: Lines, ends: Float32Array }[]} */
        this.ways = [];
        // The number of the last ones that are not painted yet.
        this.pending = 0;
    }

    get isEmpty() {
        return this.last === null;
    }

    clear() {
        this.forget(this.ways.length);
        this.last = null;
        this.scene.clearLayer(this.layer);
    }

    // The robots have moved.
    /** @param {Robots} robots */
    add({ x, y, z, count }) {
        const next = [x, y, z].map((axis) => axis.slice());
        if (this.last?.[0].length === count) {
            const [lines, ends] = [this.scene.makeLines(), endsOf(this.last, next)];
            this.scene.setLines(lines, ends);
            this.ways.push({ lines, ends });
            this.pending += 1;
            this.forget(this.ways.length - Math.max(2, Math.min(SAMPLES, Math.floor(LINES_MAX / count))));
        }
        this.last = next;
    }

    // Forgets the first samples.
    /** @param {number} count */
    forget(count) {
        if (count > 0) {
            this.ways.splice(0, count).forEach(({ lines }) => this.scene.dropLines(lines));
            this.pending = Math.min(this.pending, this.ways.length);
        }
    }

    /** @param {Color} color */
    draw(color) {
        const { scene, layer, ways } = this;
        if (this.isEmpty) {
            return;
        }
        const count = scene.readyLayer(layer) ? this.pending : ways.length;
        if (count > 0) {
            scene.paintLayer(layer, count / SAMPLES, () => ways.slice(ways.length - count).forEach(({ lines }, index) => {
                const share = 1 - (count - 1 - index) / SAMPLES;
                scene.drawLines(lines, [share, share, share, 1], 0.7);
            }));
        }
        this.pending = 0;
        scene.drawLayer(layer, color);
    }
}

// The ends of the ways of those who have moved.
/**
 * @param {Int32Array[]} from
 * @param {Int32Array[]} to
 */
function endsOf(from, to) {
    const ends = new Float32Array(6 * from[0].length);
    let count = 0;
    for (let robot = 0; robot < from[0].length; robot++) {
        if (from.some((axis, index) => axis[robot] !== to[index][robot])) {
            from.forEach((axis, index) => {
                ends[6 * count + index] = axis[robot];
                ends[6 * count + 3 + index] = to[index][robot];
            });
            count += 1;
        }
    }
    return ends.subarray(0, 6 * count);
}
