// Runs a session in the WebAssembly module, beside the page, which so never waits for it. Speaks as the server of `bbz sim --view` does:
// all events, and a sample when the page has taken the last one.

// Milliseconds that the run goes on between two looks at requests.
const TURN = 12;
// Milliseconds between two looks at the clock.
const PULSE = 15;

const get = (name) => fetch(new URL(name, import.meta.url));
const [module, { scenarios, files }] = await Promise.all([
    get("playground.wasm").then((answer) => answer.arrayBuffer()),
    get("examples.json").then((answer) => answer.json()),
]);
const { exports } = (await WebAssembly.instantiate(module, {})).instance;

let plays = false;
let isReady = true;
// The tick of the last sample; `null` if the next one is due whatever the tick.
let sampled = null;
let timer = null;

// After this message the next turn follows, without the 4 ms that timers wait at least.
const soon = new MessageChannel();
soon.port1.onmessage = () => turn();

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

function open(scenario) {
    write(scenario);
    if (exports.start() !== 1) {
        postMessage({ event: { event: "failed", text: text() } });
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
    exports.take_events();
    for (const event of JSON.parse(text())) {
        plays = event.event === "state" ? event.plays : plays;
        postMessage({ event });
    }
    const tick = exports.tick();
    if (isReady && sampled !== tick) {
        isReady = false;
        sampled = tick;
        exports.take_sample();
        const sample = output().slice();
        postMessage({ sample }, [sample.buffer]);
    }
}

onmessage = ({ data }) => {
    if (data.open) {
        open(data.open);
        sampled = null;
    } else if (data.request) {
        write(JSON.stringify(data.request));
        exports.request(performance.now());
        sampled = null;
    } else {
        isReady = true;
    }
    turn();
};

for (const [path, content] of Object.entries(files)) {
    exports.add_file(write(path, content));
}
postMessage({ scenarios });
