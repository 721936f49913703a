// Samples of a session: the bytes of a recording (docs/recording.md), piece by piece.

const MAGIC = [0x62, 0x62, 0x7a, 0x72, 0x65, 0x63, 4];
// The count of numbers of a disc, a box, and a wall, before the height or the brightness.
const OUTLINES = [3, 5, 4];

// The state of a robot that failed.
export const FAILED = 2;

export class Robots {
    constructor() {
        /** @type {Uint8Array} */
        this.bytes = new Uint8Array();
        // The next byte.
        this.at = 0;
        this.size = [0, 0];
        this.tickMs = 0;
        // Grows with each change.
        this.version = 0;
        this.tick = 0;
        /** @type {number[]} */
        this.ids = [];
        // All that is drawn, in one piece, which goes to the graphics card as it is.
        this.shown = new Uint8Array();
        // Tenths of mm.
        this.x = new Int32Array();
        this.y = new Int32Array();
        this.z = new Int32Array();
        // Turns of 1/65536.
        this.heading = new Uint16Array();
        this.led = new Uint8Array();
        this.state = new Uint8Array();
        this.isThere = new Uint8Array();
        // x and y of each disc that robots push, in tenths of mm.
        /** @type {number[]} */
        this.movables = [];
    }

    /** @param {number[]} ids */
    clear(ids) {
        const count = ids.length;
        this.ids = ids;
        this.tick = 0;
        const shown = new ArrayBuffer(17 * count);
        this.shown = new Uint8Array(shown);
        this.x = new Int32Array(shown, 0, count);
        this.y = new Int32Array(shown, 4 * count, count);
        this.z = new Int32Array(shown, 8 * count, count);
        this.heading = new Uint16Array(shown, 12 * count, count);
        this.led = new Uint8Array(shown, 14 * count, count);
        this.state = new Uint8Array(shown, 15 * count, count);
        this.isThere = new Uint8Array(shown, 16 * count, count);
        this.version += 1;
    }

    get count() {
        return this.ids.length;
    }

    // Takes a piece. Returns true if it starts a new recording.
    /** @param {Uint8Array} bytes */
    take(bytes) {
        this.bytes = bytes;
        this.at = 0;
        const isNew = MAGIC.every((byte, index) => bytes[index] === byte);
        if (isNew) {
            this.at = MAGIC.length;
            this.header();
        }
        while (this.at < bytes.length) {
            this.sample();
        }
        this.version += 1;
        return isNew;
    }

    header() {
        this.size = [this.uint(), this.uint()];
        this.tickMs = this.uint();
        const count = this.uint();
        const ids = this.differences(count);
        // Radii, paint and obstacles are skipped: the event that begins a session has them.
        this.differences(count);
        this.skipOutlines();
        this.skipOutlines();
        this.movables = [];
        for (let discs = this.uint(); discs > 0; discs--) {
            this.movables.push(this.int(), this.int());
            // Radius and height.
            this.uint();
            this.uint();
        }
        this.clear(ids);
    }

    skipOutlines() {
        for (let outlines = this.uint(); outlines > 0; outlines--) {
            const numbers = OUTLINES[this.bytes[this.at++]];
            for (let number = 0; number <= numbers; number++) {
                this.uint();
            }
        }
    }

    // Numbers of which each is the difference from the one before.
    /** @param {number} count */
    differences(count) {
        let last = 0;
        return Array.from({ length: count }, () => {
            last += this.int();
            return last;
        });
    }

    sample() {
        const length = this.uint();
        const start = this.tick;
        this.tick = start + this.uint();
        const end = this.at + length - 1;
        let robot = -1;
        while (this.at < end) {
            robot += this.uint() + 1;
            if (robot < this.count) {
                this.change(robot);
            } else {
                this.push(robot - this.count);
            }
        }
    }

    // A movable disc has another place, and nothing else.
    /** @param {number} disc */
    push(disc) {
        this.at += 1;
        this.movables[2 * disc] += this.int();
        this.movables[2 * disc + 1] += this.int();
    }

    /** @param {number} robot */
    change(robot) {
        const fields = this.bytes[this.at++];
        this.isThere[robot] = 1;
        if (fields & 1) {
            this.x[robot] += this.int();
            this.y[robot] += this.int();
        }
        if (fields & 2) {
            this.z[robot] += this.int();
        }
        if (fields & 4) {
            this.heading[robot] += this.int();
        }
        if (fields & 8) {
            const shown = this.bytes[this.at++];
            this.led[robot] = shown & 7;
            this.state[robot] = shown >> 3;
        }
    }

    uint() {
        let value = 0;
        for (let factor = 1; ; factor *= 128) {
            const byte = this.bytes[this.at++];
            value += (byte & 127) * factor;
            if (byte < 128) {
                return value;
            }
        }
    }

    int() {
        const value = this.uint();
        return value % 2 === 0 ? value / 2 : -(value + 1) / 2;
    }
}
