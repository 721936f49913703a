// The debugger's marks in the scripts of the editor: breakpoints, which the session knows by the lines of the texts that robots run, and the
// statement that is shown.

import { part, write } from "./element.js";
import { lineOf } from "./fault.js";
import { breakpointLines, breakpointsAt, statementAt, toggleBreakpoint, valuesIn } from "./statement.js";
import { texts } from "./texts.js";
import { EditorState, EditorView } from "./vendor.js";

/**
 * @import { BreakpointsEvent, StatementDescription } from "./events"
 * @import { Editor, Script } from "./editor.js"
 * @import { Texts } from "./page"
 * @import { StateEffect } from "@codemirror/state"
 */

export class Marks {
    // `chosen()` is the number of the chosen robot or null.
    /**
     * @param {Editor} editor
     * @param {() => number | null} chosen
     */
    constructor(editor, chosen) {
        this.editor = editor;
        this.chosen = chosen;
        /** @type {StatementDescription | null} */
        this.statement = null;
        // The texts that robots run, by the names of the scripts.
        /** @type {Texts} */
        this.running = {};
        this.hasSent = false;
        part("break-chosen").addEventListener("change", () => this.send());
    }

    // The session has forgotten all breakpoints.
    /** @param {Texts} running */
    begin(running) {
        this.running = { ...running };
        this.hasSent = false;
        this.showStatement(null);
        this.send();
    }

    // Robots run another text of a script.
    /**
     * @param {string} name
     * @param {string} text
     */
    ran(name, text) {
        this.running[name] = text;
        this.send();
    }

    // Another robot is chosen.
    chose() {
        if (part("break-chosen").checked) {
            this.send();
        }
    }

    // Sets a breakpoint at the line of the cursor, or removes it.
    toggle() {
        const { view } = this.editor;
        const line = view.state.doc.lineAt(view.state.selection.main.head);
        const isSet = toggleBreakpoint(view, line);
        write(part("script-status"), isSet ? texts.breakpointSet(line.number) : texts.breakpointGone(line.number));
        this.send();
        return true;
    }

    // Lines of a text that has changed since it runs are found there by what they say.
    send() {
        /** @type {Record<string, number[]>} */
        const lines = {};
        for (const { name, state } of this.editor.known()) {
            const text = this.running[name];
            const set = breakpointLines(state);
            if (text !== undefined && set.length > 0) {
                const { doc } = EditorState.create({ doc: text });
                lines[name] = set.map((line) => lineOf(doc, { line: line.number, text: line.text })).filter((line) => line !== null);
            }
        }
        if (this.hasSent || Object.keys(lines).length > 0) {
            this.hasSent = true;
            const robot = part("break-chosen").checked ? this.chosen() : null;
            this.editor.ask({ breakpoints: { lines, robot } });
        }
    }

    // The session has moved breakpoints to lines with statements, or has none.
    /** @param {BreakpointsEvent} event */
    take({ lines }) {
        for (const script of this.editor.known()) {
            const own = lines.filter((one) => one.script === script.name);
            const { doc } = script.state;
            const isOther = own.length !== breakpointLines(script.state).length || own.some(({ line, at }) => line !== at);
            if (isOther && doc.toString() === this.running[script.name]) {
                this.apply(script, breakpointsAt(doc, own.flatMap(({ at }) => at ?? [])));
                const without = own.find(({ at }) => at === null);
                if (without) {
                    write(part("script-status"), texts.noStatement(without.line));
                }
            }
        }
    }

    /**
     * @param {Script} script
     * @param {StateEffect<any>} effects
     */
    apply(script, effects) {
        if (script === this.editor.shown) {
            this.editor.view.dispatch({ effects });
        } else {
            script.state = script.state.update({ effects }).state;
        }
    }

    // Opens the script of a statement and marks it there.
    /** @param {StatementDescription | null} at */
    showStatement(at) {
        this.statement = at;
        const script = at?.place.script;
        if (script && script !== this.editor.shown?.name) {
            part("script-name").value = script;
            this.editor.open(script);
        } else {
            this.shown();
        }
    }

    // A script is shown, which may be that of the statement.
    shown() {
        const { view, shown } = this.editor;
        const { doc } = view.state;
        const at = this.statement && this.statement.place.script === shown?.name ? this.statement : null;
        const line = at && lineOf(doc, at.place);
        const values = at && line ? valuesIn(doc.line(line).text, at.memory) : "";
        // Long lines have their values out of sight.
        write(part("step-named"), values);
        const scroll = line ? [EditorView.scrollIntoView(doc.line(line).from, { y: "nearest", yMargin: 60 })] : [];
        view.dispatch({ effects: [statementAt(doc, line, values), ...scroll] });
    }
}
