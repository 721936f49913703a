// The direction from which the world is shown: from above, or in 3-D from a side.
//
// There is no perspective, so that lengths can be compared all over the picture.

const ABOVE = Math.PI / 2;
// The angle between the ground and the line of sight in 3-D: at first, and its limits.
const FIRST = Math.PI / 6;
const RISE_RANGE = [Math.PI / 12, (5 * Math.PI) / 12];
// Pixels for one mm: a kilometer is ten pixels wide, or a millimeter a whole screen.
const SCALE_RANGE = [1e-5, 1e3];

/**
 * @import { Place } from "./page"
 */

export class Camera {
    constructor() {
        // The place on the ground in the middle of the picture in mm, and pixels for one mm.
        this.x = 0;
        this.y = 0;
        this.scale = 1;
        this.isTilted = false;
        this.turn = 0;
        this.rise = ABOVE;
        this.depth = 1;
        this.height = 0;
        this.axes = [1, 0, 0, 1, 0, 0];
        this.setTilt(false);
    }

    // From above, or in 3-D.
    /** @param {boolean} isTilted */
    setTilt(isTilted) {
        this.isTilted = isTilted;
        this.set(isTilted ? Math.PI / 6 : 0, isTilted ? FIRST : ABOVE);
    }

    // Turns the world, and tilts it. Angles in radians.
    /**
     * @param {number} turn
     * @param {number} rise
     */
    turnBy(turn, rise) {
        this.set(this.turn + turn, Math.max(RISE_RANGE[0], Math.min(RISE_RANGE[1], this.rise + rise)));
    }

    /**
     * @param {number} turn
     * @param {number} rise
     */
    set(turn, rise) {
        [this.turn, this.rise] = [turn, rise];
        const [s, c] = [Math.sin(turn), Math.cos(turn)];
        // The length of one mm to the back in the picture, and of one mm of height.
        [this.depth, this.height] = this.isTilted ? [Math.sin(rise), Math.cos(rise)] : [1, 0];
        // The ways of x, y and z in the picture: right and up.
        this.axes = [c, s * this.depth, -s, c * this.depth, 0, this.height];
    }

    // Pixels to the right and up from the middle of the picture.
    /**
     * @param {number} x
     * @param {number} y
     * @returns {Place}
     */
    project(x, y, z = 0) {
        const [xRight, xUp, yRight, yUp, , zUp] = this.axes;
        const [fromX, fromY] = [(x - this.x) * this.scale, (y - this.y) * this.scale];
        return [fromX * xRight + fromY * yRight, fromX * xUp + fromY * yUp + z * zUp * this.scale];
    }

    // The way on the ground, in mm, of a way in the picture: pixels to the right and up.
    /**
     * @param {number} right
     * @param {number} up
     * @returns {Place}
     */
    way(right, up) {
        const [s, c] = [Math.sin(this.turn), Math.cos(this.turn)];
        const back = up / this.depth;
        return [(c * right + s * back) / this.scale, (c * back - s * right) / this.scale];
    }

    // The place in mm, at a height, of a place in the picture: pixels to the right and up from the middle.
    /**
     * @param {number} right
     * @param {number} up
     * @returns {Place}
     */
    placeAt(right, up, z = 0) {
        const [x, y] = this.way(right, up - z * this.height * this.scale);
        return [this.x + x, this.y + y];
    }

    // Shows a rectangle around the middle of the world, and what is above it, as large as the picture has room.
    /**
     * @param {Place} size
     * @param {number} top
     * @param {Place} room
     */
    fit([width, height], top, [roomWide, roomHigh]) {
        const [s, c] = [Math.sin(this.turn), Math.cos(this.turn)].map(Math.abs);
        const wide = width * c + height * s;
        const above = top * this.height;
        const high = (width * s + height * c) * this.depth + above;
        this.scale = Math.min(roomWide / wide, roomHigh / high) * 0.94 || 1;
        [this.x, this.y] = this.way(0, (above / 2) * this.scale);
    }

    /**
     * @param {number} right
     * @param {number} down
     */
    pan(right, down) {
        const [x, y] = this.way(right, -down);
        this.x -= x;
        this.y -= y;
    }

    // A place on the ground stays where it is in the picture.
    /**
     * @param {number} factor
     * @param {Place} place
     */
    zoom(factor, [x, y] = [this.x, this.y]) {
        const before = this.scale;
        this.scale = Math.max(SCALE_RANGE[0], Math.min(SCALE_RANGE[1], before * factor));
        this.x = x + ((this.x - x) * before) / this.scale;
        this.y = y + ((this.y - y) * before) / this.scale;
    }

    // A number that is greater for what is farther away.
    /**
     * @param {number} x
     * @param {number} y
     * @param {number} z
     */
    farness(x, y, z) {
        return (x * Math.sin(this.turn) + y * Math.cos(this.turn)) * this.height - z * this.depth;
    }
}
