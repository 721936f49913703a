// The vertical scale of a curve: the range of values that it shows, and the lines of its axis.

/**
 * @typedef {"all" | "clipped" | "log"} ScaleKind
 */

// A clipped scale shows the quartiles of these shares of the points, and half of their span above and below.
const CLIPPED = [0.1, 0.9];

// Between the two nearest of the ascending values; NaN without any.
/**
 * @param {ArrayLike<number>} values
 * @param {number} share
 */
export function quantile(values, share) {
    if (values.length === 0) {
        return NaN;
    }
    const at = share * (values.length - 1);
    const low = Math.floor(at);
    return values[low] + (values[Math.ceil(at)] - values[low]) * (at - low);
}

// Returns the multiples of 1, 2 or 5 times a power of ten from `low` to `high`: about `count` of them.
/**
 * @param {number} low
 * @param {number} high
 * @param {number} count
 */
export function ticks(low, high, count) {
    const rough = (high - low) / Math.max(1, count);
    const power = 10 ** Math.floor(Math.log10(rough));
    const step = power * ([1, 2, 5].find((factor) => factor * power >= 0.7 * rough) ?? 10);
    const first = Math.ceil(low / step - 1e-9);
    const last = Math.floor(high / step + 1e-9);
    // A sum of steps would show the errors of floating point.
    return Array.from({ length: Math.max(0, last - first + 1) }, (_, index) => Number(((first + index) * step).toPrecision(12)));
}

// Returns the powers of ten in a range, with 2 and 5 times them in a small one.
/**
 * @param {number} low
 * @param {number} high
 */
function logTicks(low, high) {
    const [first, last] = [Math.floor(Math.log10(low)), Math.ceil(Math.log10(high))];
    const factors = last - first > 3 ? [1] : [1, 2, 5];
    const powers = Array.from({ length: last - first + 1 }, (_, index) => first + index);
    const all = powers.flatMap((power) => factors.map((factor) => Number((factor * 10 ** power).toPrecision(12))));
    return all.filter((tick) => tick >= low && tick <= high);
}

export class Scale {
    /**
     * @param {ScaleKind} kind
     * @param {number[][]} fives extremes, quartiles and median of each point
     * @param {number[]} limits of expectations, shown if they are near
     */
    constructor(kind, fives, limits) {
        this.isLog = kind === "log";
        const of = (/** @type {number} */ place) => fives.map((five) => five[place]).filter((value) => Number.isFinite(value) && !(this.isLog && value <= 0));
        // Without a loop over arguments: there may be thousands.
        const least = (/** @type {number[]} */ values) => values.reduce((low, value) => Math.min(low, value), Infinity);
        const most = (/** @type {number[]} */ values) => values.reduce((high, value) => Math.max(high, value), -Infinity);
        // Where robots have no positive value, quartiles may be the least ones that a logarithm can show.
        this.low = this.isLog ? least([0, 1, 2, 3, 4].flatMap(of)) : least(of(0));
        this.high = most(of(4));
        // The extremes, if they are out of sight.
        this.below = NaN;
        this.above = NaN;
        this.isKnown = this.high >= this.low;
        if (!this.isKnown) {
            return;
        }
        const [low, high] = [this.low, this.high];
        if (kind === "clipped") {
            const ascending = (/** @type {number} */ place) => of(place).sort((one, other) => one - other);
            const [bottom, top] = [quantile(ascending(1), CLIPPED[0]), quantile(ascending(3), CLIPPED[1])];
            const room = (top - bottom) / 2 || Math.abs(top) / 10 || 1;
            [this.low, this.high] = [Math.max(low, bottom - room), Math.min(high, top + room)];
            [this.below, this.above] = [this.low > low ? low : NaN, this.high < high ? high : NaN];
        } else if (kind === "all") {
            const span = high - low || Math.abs(high) || 1;
            limits.filter((limit) => limit >= low - span && limit <= high + span).forEach((limit) => {
                [this.low, this.high] = [Math.min(this.low, limit), Math.max(this.high, limit)];
            });
        }
        if (!(this.high > this.low)) {
            [this.low, this.high] = this.isLog ? [this.low / 2, this.high * 2] : [this.low - 1, this.high + 1];
        }
    }

    // Returns the place of a value: 0 at the bottom, 1 at the top.
    /** @param {number} value */
    share(value) {
        return this.isLog ? Math.log(value / this.low) / Math.log(this.high / this.low) : (value - this.low) / (this.high - this.low);
    }

    // Returns the values of the lines of the axis.
    /** @param {number} count */
    ticks(count) {
        const powers = this.isLog ? logTicks(this.low, this.high) : [];
        // In a part of a decade, other round numbers are closer.
        return powers.length > 2 ? powers : ticks(this.low, this.high, count);
    }
}
