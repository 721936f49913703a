// The compiler's messages below a text, and their explanations.

import { element, inside, part, printable, write } from "./element.js";
import { texts } from "./texts.js";
import { setDiagnostics } from "./vendor.js";

/**
 * @import { CompilerMessage, DiagnosticsEvent, ExplanationEvent } from "./events"
 * @import { Editor } from "./editor.js"
 */

// The compiler's messages. The text may have changed since: places are moved into it.
/**
 * @param {Editor} editor
 * @param {DiagnosticsEvent} event
 */
export function showMessages(editor, { name, diagnostics }) {
    const { shown, view } = editor;
    if (shown?.name !== name) {
        return;
    }
    const { doc } = view.state;
    const at = (line = 1, column = 1) => {
        const { from, text } = doc.line(Math.max(1, Math.min(line, doc.lines)));
        // Columns are characters, places in the text are units of UTF-16.
        return from + [...text].slice(0, column - 1).join("").length;
    };
    const isHere = (/** @type {{ file?: string }} */ one) => one.file === shown.file;
    /** @type {(message: CompilerMessage) => (() => void) | null} */
    const fixOf = ({ edits }) => {
        if (edits.length === 0 || !edits.every(isHere)) {
            return null;
        }
        const changes = edits.map((edit) => ({ from: at(edit.line, edit.column), to: at(edit.end_line, edit.end_column), insert: edit.text }));
        return () => view.dispatch({ changes });
    };
    const found = diagnostics.map((one) => ({ ...one, fix: fixOf(one), from: isHere(one) ? at(one.line, one.column) : 0 }));
    const marks = found.filter(isHere).map((one) => ({
        from: one.from, to: Math.max(one.from, at(one.end_line, one.end_column)), severity: one.severity, source: one.code,
        message: printable(one.help ? `${one.message}\n${texts.help}: ${one.help}` : one.message),
    }));
    marks.push(...(editor.mark ? [editor.mark] : []));
    marks.sort((a, b) => a.from - b.from);
    view.dispatch(setDiagnostics(view.state, marks));
    const explain = (/** @type {string} */ code) => () => editor.ask({ explain: { code } });
    const lines = found.map((one) => element("li", { class: one.severity },
        // Mistakes of scenarios have no code, and some have no place.
        ...(one.code ? [element("button", { type: "button", title: texts.explainHelp, onclick: explain(one.code) }, one.code)] : []),
        ...(one.file ? [element("button", { type: "button", class: "place", title: texts.goThere, onclick: () => editor.goTo(one.from) },
            isHere(one) ? texts.line(one.line ?? 1) : `${shortName(one.file, editor.world)}:${one.line}`)] : []),
        element("span", {}, one.message, ...(one.help ? [element("small", {}, ` ${one.help}`)] : [])),
        ...(one.fix ? [element("button", { type: "button", title: texts.fixHelp, onclick: one.fix }, texts.fix)] : [])));
    part("diagnostics").replaceChildren(...lines);
}

// A file in the folder of the scenario has no other name for users.
/**
 * @param {string} file
 * @param {string} [scenario] the path of the scenario
 */
function shortName(file, scenario) {
    const folder = scenario?.replace(/[^\\/]*$/, "") ?? "";
    return file.startsWith(folder) ? file.slice(folder.length) : file;
}

// The explanation of a code.
/** @param {ExplanationEvent} event */
export function showExplanation({ text }) {
    const [heading, ...lines] = text.split("\n");
    write(inside(part("explanation"), "h2"), heading.replace(/^#+ /, ""));
    inside(part("explanation"), "div").replaceChildren(...lines.join("\n").split(/^```\w*$/m).flatMap(explained));
    part("explanation").showModal();
}

// A part of an explanation: each second one is an example, the others have paragraphs with names between back quotes.
/**
 * @param {string} text
 * @param {number} number
 * @returns {HTMLElement[]}
 */
function explained(text, number) {
    if (number % 2 === 1) {
        return [element("pre", {}, text.trim())];
    }
    /** @type {(piece: string, at: number) => string | Node} */
    const names = (piece, at) => (at % 2 === 1 ? element("code", {}, piece) : piece);
    return text.trim().split(/\n\n+/).map((one) => element("p", {}, ...one.split("`").map(names)));
}
