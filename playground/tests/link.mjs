// Tests of the scripts in an address.
import assert from "node:assert/strict";
import { constants, deflateRawSync } from "node:zlib";

import { LinkTooLong, pack, unpack } from "../web/link.js";

const MIB = 1 << 20;

// Returns a script of an address, compressed as much as possible.
function packed(path, length) {
    const bytes = deflateRawSync(Buffer.alloc(length, " "), { level: constants.Z_BEST_COMPRESSION });
    return `${encodeURIComponent(path)}=${bytes.toString("base64url")}`;
}

// The bytes that leave the decompression.
let read = 0;
class CountedStream extends DecompressionStream {
    get readable() {
        const counter = new TransformStream({
            transform(piece, controller) {
                read += piece.length;
                controller.enqueue(piece);
            },
        });
        return super.readable.pipeThrough(counter);
    }
}
globalThis.DecompressionStream = CountedStream;

const text = "function step() { log('\u00fc') }\n".repeat(100);
assert.deepEqual(await unpack([`a%2Fb.bzz=${await pack(text)}`]), { "a/b.bzz": text });

const longest = await unpack([packed("a", MIB)]);
assert.equal(longest.a.length, MIB);

read = 0;
await assert.rejects(unpack([packed("a.bzz", 256 * MIB)]), (error) => error instanceof LinkTooLong && error.path === "a.bzz");
assert.ok(read < 2 * MIB, `${read} bytes were decompressed`);

read = 0;
const many = Array.from({ length: 100 }, (_, number) => packed(`${number}.bzz`, MIB));
await assert.rejects(unpack(many), (error) => error instanceof LinkTooLong && error.path === "4.bzz");
assert.ok(read < 6 * MIB, `${read} bytes were decompressed`);

await assert.rejects(unpack(["a=AAAA"]), (error) => !(error instanceof LinkTooLong));
