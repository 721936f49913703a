// The marks of a debugger in the editor: breakpoints in the gutter, the statement that is shown, and values beside it.

import { printable } from "./element.js";
import { texts } from "./texts.js";
import { Decoration, EditorView, gutter, GutterMarker, lineNumbers, RangeSet, StateEffect, StateField, WidgetType } from "./vendor.js";

/**
 * @import { MemoryDescription, ValueDescription } from "./events"
 * @import { EditorState, Extension, Line, Text } from "@codemirror/state"
 */

// Lets the lines that begin at some places have breakpoints, and no others.
/** @type {ReturnType<typeof StateEffect.define<number[]>>} */
const setBreakpoints = StateEffect.define();

// Marks the line that begins at a place, with a text beside it; `null`: none.
/** @type {ReturnType<typeof StateEffect.define<{ from: number, values: string } | null>>} */
const setStatement = StateEffect.define();

class Dot extends GutterMarker {
    toDOM() {
        const dot = document.createElement("div");
        dot.className = "cm-breakpoint";
        dot.title = texts.breakpoint;
        return dot;
    }
}

class Values extends WidgetType {
    /** @param {string} text */
    constructor(text) {
        super();
        this.text = text;
    }

    /** @param {Values} other */
    eq(other) {
        return other.text === this.text;
    }

    toDOM() {
        const span = document.createElement("span");
        span.className = "cm-values";
        span.textContent = printable(this.text);
        return span;
    }
}

const dot = new Dot();

/** @type {StateField<RangeSet<GutterMarker>>} */
const breakpoints = StateField.define({
    create: () => RangeSet.empty,
    update(before, { changes, effects, startState, state }) {
        const set = effects.find((effect) => effect.is(setBreakpoints));
        if (set) {
            return RangeSet.of([...new Set(/** @type {number[]} */ (set.value))].sort((a, b) => a - b).map((from) => dot.range(from)));
        }
        if (changes.empty) {
            return before;
        }
        const kept = placesOf(before).filter((from) => changes.touchesRange(from, startState.doc.lineAt(from).to) !== "cover");
        // Lines that were joined have one breakpoint, at their beginning.
        const mapped = kept.map((from) => state.doc.lineAt(changes.mapPos(from, 1)).from);
        return RangeSet.of([...new Set(mapped)].sort((a, b) => a - b).map((from) => dot.range(from)));
    },
});

/** @type {StateField<RangeSet<Decoration>>} */
const statement = StateField.define({
    create: () => RangeSet.empty,
    update(before, { changes, effects, state }) {
        const set = effects.find((effect) => effect.is(setStatement));
        if (!set) {
            return before.map(changes);
        }
        if (set.value === null) {
            return RangeSet.empty;
        }
        const { from, values } = set.value;
        const line = Decoration.line({ class: "cm-statement" }).range(from);
        const beside = Decoration.widget({ widget: new Values(values), side: 1 }).range(state.doc.lineAt(from).to);
        return RangeSet.of(values === "" ? [line] : [line, beside], true);
    },
    provide: (field) => EditorView.decorations.from(field),
});

/** @param {RangeSet<GutterMarker>} set */
function placesOf(set) {
    /** @type {number[]} */
    const places = [];
    set.between(0, Number.MAX_SAFE_INTEGER, (from) => {
        places.push(from);
    });
    return places;
}

// The marks, for a script. `onBreakpoints()` when the user has set or removed one.
/**
 * @param {() => void} onBreakpoints
 * @returns {Extension}
 */
export function statementMarks(onBreakpoints) {
    const domEventHandlers = {
        mousedown(/** @type {EditorView} */ view, /** @type {{ from: number }} */ { from }) {
            toggleBreakpoint(view, view.state.doc.lineAt(from));
            onBreakpoints();
            return true;
        },
    };
    return [
        breakpoints, statement,
        gutter({ class: "cm-breakpoints", markers: (view) => view.state.field(breakpoints), initialSpacer: () => dot, domEventHandlers }),
        lineNumbers({ domEventHandlers }),
    ];
}

// Sets or removes the breakpoint of a line. Returns true if it has one now.
/**
 * @param {EditorView} view
 * @param {Line} line
 */
export function toggleBreakpoint(view, line) {
    const places = placesOf(view.state.field(breakpoints));
    const others = places.filter((from) => from !== line.from);
    const isSet = others.length === places.length;
    view.dispatch({ effects: setBreakpoints.of(isSet ? [...places, line.from] : others) });
    return isSet;
}

// The lines with breakpoints. The state of a scenario has none.
/** @param {EditorState} state */
export function breakpointLines(state) {
    const set = state.field(breakpoints, false);
    return set ? placesOf(set).map((from) => state.doc.lineAt(from)) : [];
}

// Returns the effect that lets lines have breakpoints, by their numbers.
/**
 * @param {Text} doc
 * @param {number[]} lines
 */
export function breakpointsAt(doc, lines) {
    return setBreakpoints.of(lines.map((line) => doc.line(line).from));
}

// Returns the effect that marks a line; `null`: none.
/**
 * @param {Text} doc
 * @param {number | null} line
 * @param {string} values
 */
export function statementAt(doc, line, values) {
    return setStatement.of(line === null ? null : { from: doc.line(line).from, values });
}

// The values of the names in a line, as a text beside it.
/**
 * @param {string} line
 * @param {MemoryDescription} memory
 */
export function valuesIn(line, memory) {
    // What follows is a comment.
    const code = line.replace(/"(?:[^"\\]|\\.)*"|'(?:[^'\\]|\\.)*'/g, "").replace(/#.*/, "");
    const names = new Set([...code.matchAll(/(?<![\w.])[A-Za-z_]\w*/g)].map(([name]) => name));
    const locals = new Map(memory.frames[0]?.locals ?? []);
    const globals = new Map(memory.globals);
    const shown = [...names].flatMap((name) => {
        const value = locals.has(name) ? locals.get(name) : globals.get(name);
        const text = value === undefined ? null : inWords(value, memory.objects);
        return text === null ? [] : [`${name} = ${text}`];
    });
    return shown.join(", ");
}

// A value as a script would write it; `null` for functions, which tell nothing new.
/**
 * @param {ValueDescription} value
 * @param {MemoryDescription["objects"]} objects
 */
function inWords(value, objects) {
    if (value === null) {
        return "nil";
    }
    if (typeof value === "number") {
        return String(value);
    }
    if (typeof value === "string") {
        return `"${value}"`;
    }
    if ("table" in value) {
        const object = objects[value.table];
        return object && "entries" in object ? `{${texts.table(object.entries.length + object.left_out)}}` : "{…}";
    }
    return "float" in value ? value.float : "unset" in value ? "nil" : null;
}
