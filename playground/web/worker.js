// Runs a session in the WebAssembly module in a thread of its own, so that the page never waits. It sends what the server of `bbz sim --view` sends:
// events, and a sample if there is a new one, when the page has taken the last ones.

/**
 * @import { FromWorker, Texts, ToWorker } from "./page"
 */

/**
 * The functions of the module (playground/src/lib.rs).
 * @typedef {object} Exports
 * @property {WebAssembly.Memory} memory
 * @property {(length: number) => number} input
 * @property {(nameLength: number) => void} add_file
 * @property {() => number} start
 * @property {(now: number) => void} request
 * @property {(now: number, most: number) => number} advance
 * @property {() => void} take_events
 * @property {() => void} take_sample
 * @property {() => number} tick
 * @property {() => number} output
 * @property {() => number} output_length
 */

// Milliseconds that the run advances before requests are handled.
const TURN = 12;
// Milliseconds between two checks of the clock.
const PULSE = 15;

// The files of the examples, and the functions of the module.
/** @type {Texts} */
let files = {};
/** @type {Exports} */
let exports;

let plays = false;
let isReady = true;
// The tick of the last sample; `null` if the next one is due whatever the tick.
/** @type {number | null} */
let sampled = null;
let timer = 0;

/** @type {(message: FromWorker, transferred?: Transferable[]) => void} */
const report = (message, transferred = []) => postMessage(message, transferred);

// After this message the next turn follows, without the 4 ms that timers wait at least.
const soon = new MessageChannel();
soon.port1.onmessage = () => turn();

/** @param {string[]} texts */
function write(...texts) {
    const parts = texts.map((text) => new TextEncoder().encode(text));
    const address = exports.input(parts.reduce((sum, part) => sum + part.length, 0));
    // The memory may have grown, and then it is another buffer.
    parts.reduce((at, part) => {
        new Uint8Array(exports.memory.buffer).set(part, at);
        return at + part.length;
    }, address);
    return parts[0].length;
}

function output() {
    return new Uint8Array(exports.memory.buffer, exports.output(), exports.output_length());
}

const text = () => new TextDecoder().decode(output());

// `own` are files in the place of the examples'.
/**
 * @param {string} scenario
 * @param {Texts} own
 */
function open(scenario, own) {
    for (const [path, content] of Object.entries({ ...files, ...own })) {
        exports.add_file(write(path, content));
    }
    write(scenario);
    if (exports.start() === 1) {
        return;
    }
    const reason = text();
    if (Object.keys(own).length === 0) {
        report({ events: [{ event: "failed", text: reason }] });
    } else {
        // The example runs, and the editor has the scripts.
        open(scenario, {});
        report({ events: [{ event: "offered", scripts: own }] });
    }
}

function turn() {
    clearTimeout(timer);
    const end = performance.now() + TURN;
    let isLate;
    do {
        isLate = exports.advance(performance.now(), 1) === 1;
    } while (isLate && performance.now() < end);
    send();
    if (isLate) {
        soon.port2.postMessage(null);
    } else if (plays) {
        timer = setTimeout(turn, PULSE);
    }
}

function send() {
    if (!isReady) {
        return;
    }
    const tick = exports.tick();
    let sample;
    if (sampled !== tick) {
        sampled = tick;
        exports.take_sample();
        sample = output().slice();
    }
    exports.take_events();
    const events = JSON.parse(text());
    for (const event of events) {
        plays = event.event === "state" ? event.plays : plays;
    }
    if (sample) {
        isReady = false;
        report({ events, sample }, [sample.buffer]);
    } else if (events.length > 0) {
        isReady = false;
        report({ events });
    }
}

/** @param {MessageEvent<ToWorker>} message */
function carryOut({ data }) {
    if ("open" in data) {
        open(data.open, data.files ?? {});
        sampled = null;
    } else if ("request" in data) {
        write(JSON.stringify(data.request));
        exports.request(performance.now());
        sampled = null;
    } else {
        isReady = true;
    }
    turn();
}

// An error within a promise reaches the page as one outside.
addEventListener("unhandledrejection", ({ reason }) => {
    throw reason;
});

// The first message has module and files. No module of JavaScript: a page from a file could not start it.
onmessage = async ({ data }) => {
    files = data.files;
    const { instance } = await WebAssembly.instantiate(data.module, {});
    exports = /** @type {Exports} */ (/** @type {unknown} */ (instance.exports));
    onmessage = carryOut;
    report({ isReady: true });
};
