// Buzz in the editor: its words in colors, and names that complete themselves.

import { ifNotIn, StreamLanguage } from "./vendor.js";

const KEYWORDS = /^(?:var|function|return|if|else|for|while|and|or|not|include)\b/;
const CONSTANTS = /^(?:nil|self|id|swarm|neighbors|stigmergy|math|string|pos)\b/;

/**
 * @import { Word } from "./events"
 * @import { CompletionContext, CompletionResult, CompletionSource } from "@codemirror/autocomplete"
 * @import { StreamParser } from "@codemirror/language"
 */

/** @type {StreamParser<{ quote: string | null, depth: number }>} */
const parser = {
    name: "buzz",
    // The quote that ends the string, and the number of open brackets.
    startState: () => ({ quote: null, depth: 0 }),
    token(stream, state) {
        if (state.quote === null) {
            if (stream.eatSpace()) {
                return null;
            }
            if (stream.match(/^#.*/)) {
                return "comment";
            }
            if (stream.match(KEYWORDS)) {
                return "keyword";
            }
            if (stream.match(CONSTANTS)) {
                return "atom";
            }
            if (stream.match(/^(?:0[xX][0-9a-fA-F]+|(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)/)) {
                return "number";
            }
            if (stream.match(/^[A-Za-z_]\w*/)) {
                return stream.match(/^\s*\(/, false) ? "variableName.function" : "variableName";
            }
            state.quote = ["\"", "'"].find((quote) => stream.eat(quote)) ?? null;
            if (state.quote === null) {
                const sign = stream.next() ?? "";
                state.depth = Math.max(state.depth + Number("{([".includes(sign)) - Number("})]".includes(sign)), 0);
                return "operator";
            }
        }
        // A string may go on in the next line.
        for (let letter = stream.next(); letter !== undefined; letter = stream.next()) {
            if (letter === "\\") {
                stream.next();
            } else if (letter === state.quote) {
                state.quote = null;
                break;
            }
        }
        return "string";
    },
    languageData: { commentTokens: { line: "#" }, closeBrackets: { brackets: ["(", "[", "{", "\"", "'"] }, indentOnInput: /^\s*\}$/ },
    indent({ quote, depth }, textAfter, { unit }) {
        return quote === null ? unit * Math.max(depth - Number(/^[})\]]/.test(textAfter)), 0) : null;
    },
};

export const buzz = StreamLanguage.define(parser);

// Completes names from `words` (crate live, words.rs), and those of the text itself. In comments and strings the Enter key
// would take a name where a new line was meant.
/**
 * @param {() => Word[]} words
 * @returns {CompletionSource}
 */
export function completing(words) {
    return ifNotIn(["comment", "string"], (/** @type {CompletionContext} */ context) => {
        const before = context.matchBefore(/[\w.]*/);
        if (!before || (before.from === before.to && !context.explicit) || /^[\d.]/.test(before.text)) {
            return null;
        }
        const dot = before.text.lastIndexOf(".");
        const of = before.text.slice(0, Math.max(dot, 0));
        const hasTable = words().some((word) => word.of === of);
        /** @type {CompletionResult["options"][number][]} */
        const options = words().filter((word) => word.of === (hasTable ? of : "*")).map(({ name, call, help, is_called }) => ({
            label: name, detail: call, info: help || undefined, type: is_called ? "function" : "property",
        }));
        if (dot < 0) {
            const known = new Set(options.map(({ label }) => label));
            /** @type {string[]} */
            const names = context.state.doc.toString().match(/\b[A-Za-z_]\w*/g) ?? [];
            // The word that is being written is a name only if it is written elsewhere, too.
            const own = new Set(names.toSpliced(names.indexOf(before.text), 1));
            own.forEach((label) => known.has(label) || options.push({ label, type: "variable", boost: -1 }));
        }
        /** @type {CompletionResult} */
        const result = { from: before.from + dot + 1, options, validFor: /^\w*$/ };
        return result;
    });
}
