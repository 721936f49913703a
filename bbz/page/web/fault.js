// Run-time errors of scripts: their message, place, values and help, and their mark in the editor.

import { element } from "./element.js";
import { texts } from "./texts.js";

/**
 * @import { FaultEvent, FaultPlace } from "./events"
 * @import { Text } from "@codemirror/state"
 */

/**
 * Opens a place of a fault.
 * @typedef {(fault: FaultEvent, place: FaultPlace) => void} OpenPlace
 */

// Names between back quotes are code.
/** @param {string} text */
export function withCode(text) {
    return text.split("`").map((piece, at) => (at % 2 === 1 ? element("code", {}, piece) : piece));
}

// The innermost place that the editor can show.
/** @param {FaultEvent} fault */
export function editedPlace({ places }) {
    return places.find((place) => place?.script) ?? null;
}

// The message, the place as a link, the values and the help; with `isWhole` also the source line and the calls that led there.
/**
 * @param {FaultEvent} fault
 * @param {OpenPlace} open
 * @returns {(string | Node)[]}
 */
export function faultParts(fault, open, isWhole = false) {
    const { message, help, notes, values, places } = fault;
    const value = values.map(({ name, value }) => element("span", { class: "value" }, element("code", {}, name), texts.is, element("code", {}, value)));
    const place = places[0];
    return [
        element("span", { class: "what" }, ...withCode(message)),
        ...(place ? [" ", linkTo(fault, place, open)] : []),
        ...(isWhole && place ? excerpt(place) : []),
        ...(value.length > 0 ? [element("span", { class: "values" }, ...value)] : []),
        ...[...notes, ...(help ? [`${texts.help}: ${help}`] : [])].map((text) => element("small", {}, ...withCode(text))),
        ...(isWhole ? calls(fault, open) : []),
    ];
}

// A place as text, or as a button if the editor can show it.
/**
 * @param {FaultEvent} fault
 * @param {FaultPlace} place
 * @param {OpenPlace} open
 */
function linkTo(fault, place, open) {
    const text = texts.faultPlace(place);
    return place.script
        ? element("button", { type: "button", class: "place-link", title: texts.goThere, onclick: () => open(fault, place) }, text)
        : element("span", { class: "place-link" }, text);
}

// The source line with the instruction marked.
/** @param {FaultPlace} place */
function excerpt({ text, line, column, end_line: endLine, end_column: endColumn }) {
    if (text === null) {
        return [];
    }
    const letters = [...text];
    const [start, end] = [column - 1, endLine === line ? endColumn - 1 : letters.length];
    const [before, marked, after] = [letters.slice(0, start), letters.slice(start, end), letters.slice(end)].map((piece) => piece.join(""));
    return [element("code", { class: "excerpt" }, before.trimStart(), element("mark", {}, marked), after)];
}

// The places of the calls that led to a fault.
/**
 * @param {FaultEvent} fault
 * @param {OpenPlace} open
 */
function calls(fault, open) {
    const [, ...callers] = fault.places;
    const lines = callers.map((place) => element("span", {}, texts.calledAt, place ? linkTo(fault, place, open) : texts.unknownPlace));
    if (fault.left_out > 0) {
        // The two outermost calls come after those that were left out.
        lines.splice(Math.max(lines.length - 2, 0), 0, element("span", {}, texts.moreCalls(fault.left_out)));
    }
    return lines.length > 0 ? [element("small", { class: "calls" }, ...lines)] : [];
}

// The mark in a text: at the line of the fault, or at the nearest equal one if lines were added or removed. Returns `null` if the
// line has changed.
/**
 * @param {Text} doc
 * @param {FaultEvent} fault
 * @param {FaultPlace} place
 * @returns {{ from: number, to: number, severity: "error", source: string, message: string } | null}
 */
export function markOf(doc, fault, place) {
    const number = lineOf(doc, place);
    if (number === null) {
        return null;
    }
    const { from, text } = doc.line(number);
    // Columns are characters, places in the text are units of UTF-16.
    const at = (/** @type {number} */ column) => from + [...text].slice(0, column - 1).join("").length;
    const to = place.end_line === place.line ? at(place.end_column) : from + text.length;
    const values = fault.values.map(({ name, value }) => name + texts.is + value);
    const lines = [fault.message, ...values, ...(fault.help ? [`${texts.help}: ${fault.help}`] : [])];
    return { from: at(place.column), to, severity: "error", source: fault.code, message: lines.join("\n") };
}

// Returns the number of the line of a place, or of the nearest equal one if lines were added or removed; `null` if the line has changed.
/**
 * @param {Text} doc
 * @param {{ line: number, text: string | null }} place
 */
export function lineOf(doc, { line, text }) {
    for (let away = 0; away < doc.lines; away += 1) {
        for (const number of [line - away, line + away]) {
            if (number >= 1 && number <= doc.lines && (text === null || doc.line(number).text === text)) {
                return number;
            }
        }
    }
    return null;
}
