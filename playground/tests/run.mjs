// Runs scenarios in the WebAssembly module, and prints a line for each: its path, the ticks that have passed, and the digest; or the
// error. Usage: node run.mjs MODULE FOLDER TICKS SCENARIO...
import { readFileSync, readdirSync } from "node:fs";

const [modulePath, folder, ticks, ...scenarios] = process.argv.slice(2);
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

for (const name of readdirSync(folder)) {
    const path = Buffer.from(name);
    write(path, readFileSync(`${folder}/${name}`));
    exports.add_file(path.length);
}
for (const scenario of scenarios) {
    write(Buffer.from(scenario));
    if (exports.start() === 1) {
        const passed = exports.tick(Number(ticks));
        console.log(`${scenario} ${passed} ${BigInt.asUintN(64, exports.digest()).toString(16)}`);
    } else {
        const text = Buffer.from(exports.memory.buffer, exports.output(), exports.output_length());
        console.log(`${scenario} ${text.toString().trim()}`);
    }
}
