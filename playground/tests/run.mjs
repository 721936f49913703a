// Runs scenarios in the WebAssembly module, and prints a line for each: its path, the ticks that have passed, and the digest; or the
// error. Then plays the session in the first of them, and prints the events and the sample after each of its requests.
// Usage: node run.mjs MODULE FOLDER TICKS SESSION SCENARIO...
import { readFileSync, readdirSync } from "node:fs";

const [modulePath, folder, ticks, sessionPath, ...scenarios] = process.argv.slice(2);
const module = new WebAssembly.Module(readFileSync(modulePath));
const imports = WebAssembly.Module.imports(module);
if (imports.length > 0) {
    throw new Error(`the module imports ${JSON.stringify(imports)}`);
}
const { exports } = new WebAssembly.Instance(module, {});

function write(...parts) {
    const bytes = Buffer.concat(parts);
    // The memory may grow, and then it is another buffer.
    const address = exports.input(bytes.length);
    new Uint8Array(exports.memory.buffer, address, bytes.length).set(bytes);
}

function read() {
    return Buffer.from(exports.memory.buffer, exports.output(), exports.output_length());
}

function start(scenario) {
    write(Buffer.from(scenario));
    return exports.start() === 1;
}

function request(text, now) {
    write(Buffer.from(text));
    exports.request(now);
}

for (const name of readdirSync(folder)) {
    const path = Buffer.from(name);
    write(path, readFileSync(`${folder}/${name}`));
    exports.add_file(path.length);
}
for (const scenario of scenarios) {
    if (start(scenario)) {
        request(`{"step":{"ticks":${ticks}}}`, 0);
        while (exports.advance(0, 1000) === 1);
        exports.take_events();
        const state = JSON.parse(read()).findLast((event) => event.event === "state");
        const digest = BigInt.asUintN(64, exports.digest()).toString(16);
        console.log(`${scenario} ${state.tick} ${digest}`);
    } else {
        console.log(`${scenario} ${read().toString().trim()}`);
    }
}
start(scenarios[0]);
for (const [text, now, most] of JSON.parse(readFileSync(sessionPath))) {
    if (text !== null) {
        request(text, now);
    }
    exports.advance(now, most);
    exports.take_sample();
    const sample = read().toString("hex");
    exports.take_events();
    console.log(`${read()} ${sample}`);
}
