// The seed of a scenario, in its text.

const HEADER = /^\s*\[{1,2}\s*[A-Za-z_"'][^\]=]*\]{1,2}\s*(#.*)?$/;

// Returns a scenario's text with another seed; null if it has no section `[world]`.
/**
 * @param {string} text
 * @param {number} seed
 */
export function withSeed(text, seed) {
    const lines = text.split("\n");
    const world = lines.findIndex((line) => /^\s*\[\s*world\s*\]/.test(line));
    if (world < 0) {
        return null;
    }
    const next = lines.findIndex((line, at) => at > world && HEADER.test(line));
    const own = lines.findIndex((line, at) => at > world && (next < 0 || at < next) && /^\s*seed\s*=/.test(line));
    if (own < 0) {
        lines.splice(world + 1, 0, `seed = ${seed}`);
    } else {
        lines[own] = lines[own].replace(/=\s*[\w+]+/, `= ${seed}`);
    }
    return lines.join("\n");
}
