// The editor of the scenario's scripts.

import { buzz, completing } from "./buzz.js";
import { element, inside, option, part, printable, save, write } from "./element.js";
import { faultParts, markOf } from "./fault.js";
import { Marks } from "./marks.js";
import { statementMarks } from "./statement.js";
import { texts } from "./texts.js";
import {
    autocompletion, bracketMatching, closeBrackets, closeBracketsKeymap, completionKeymap, defaultKeymap, drawSelection, EditorState,
    EditorView, foldGutter, foldKeymap, highlightActiveLine, highlightSelectionMatches, highlightSpecialChars, HighlightStyle, history,
    historyKeymap, indentOnInput, indentUnit, keymap, lineNumbers, lintGutter, lintKeymap, searchKeymap, setDiagnostics, syntaxHighlighting, tags,
} from "./vendor.js";

// Milliseconds from the last key until the compiler checks the text.
const PAUSE = 150;

// Milliseconds from a change until the session has the text, so that a crash loses little.
const KEEP = 500;

const colors = HighlightStyle.define([
    { tag: tags.keyword, color: "var(--accent)", fontWeight: "600" }, { tag: tags.comment, color: "var(--soft)", fontStyle: "italic" },
    { tag: tags.string, color: "var(--held)" }, { tag: [tags.number, tags.atom], color: "var(--number)" },
    { tag: tags.function(tags.variableName), color: "var(--accent)" },
]);

const theme = EditorView.theme({
    "&": { height: "100%", fontSize: ".85rem", backgroundColor: "var(--panel)", color: "var(--text)" },
    ".cm-scroller": { fontFamily: "ui-monospace, \"Cascadia Mono\", \"DejaVu Sans Mono\", monospace", lineHeight: "1.5" },
    ".cm-content": { caretColor: "var(--text)" },
    "&.cm-focused": { outline: "3px solid var(--mark)", outlineOffset: "-3px" },
    ".cm-cursor": { borderLeftColor: "var(--text)" },
    ".cm-gutters": { backgroundColor: "var(--panel)", color: "var(--soft)", borderRight: "1px solid var(--line)" },
    ".cm-activeLine, .cm-activeLineGutter": { backgroundColor: "var(--hover)" },
    "&.cm-focused > .cm-scroller > .cm-selectionLayer .cm-selectionBackground, .cm-selectionBackground": { backgroundColor: "var(--chosen)" },
    "&.cm-focused .cm-matchingBracket": { backgroundColor: "var(--chosen)" },
    ".cm-tooltip, .cm-panels": { backgroundColor: "var(--panel)", color: "var(--text)", border: "1px solid var(--line)" },
    ".cm-tooltip-autocomplete > ul > li[aria-selected]": { backgroundColor: "var(--accent)", color: "var(--panel)" },
    ".cm-completionInfo": { maxWidth: "22rem" },
    ".cm-breakpoints": { width: ".9rem" }, ".cm-breakpoints, .cm-breakpoints + .cm-lineNumbers": { cursor: "pointer" },
    ".cm-breakpoint": { width: ".65rem", height: ".65rem", margin: ".3rem auto 0", border: "1px solid var(--faulted)", borderRadius: "50%", backgroundColor: "var(--faulted)" },
    ".cm-statement": { backgroundColor: "var(--chosen)", boxShadow: "inset 3px 0 var(--mark)" },
    ".cm-values": { marginLeft: "1.5rem", padding: "0 .35rem", borderRadius: ".2rem", backgroundColor: "var(--panel)", color: "var(--mark-text)" },
    ".cm-button, .cm-textfield": { backgroundImage: "none", backgroundColor: "var(--panel)", color: "var(--text)", borderColor: "var(--line)" },
});

/**
 * @import {
 *   ChangedEvent, CompilerMessage, DiagnosticsEvent, ExplanationEvent, FaultEvent, FaultPlace, RanEvent, ScriptEvent, SuggestedEdit, UnsavedText, Word,
 *   WrittenEvent,
 * } from "./events"
 * @import { Ask, Texts, World } from "./page"
 */

/**
 * A script of a world. `opened` is the text that came from the session, `kept` the one that is in the file, with its hash, `sent` are those
 * that the session got from this page, `written` is the one that is being saved, and `unsaved` the one that the session keeps because no file
 * has it.
 * @typedef {{
 *   name: string, file: string, world: string | undefined, opened: string, kept: string, sha256: string, sent: Set<string>, written?: string,
 *   unsaved: string | null, words: Word[], state: EditorState,
 * }} Script
 */

export class Editor {
    // `ask(request)` asks the session, `onRun()` when robots have got another script, `onText()` when a text has changed, `chosen()` is the
    // id of the chosen robot or null.
    /**
     * @param {Ask} ask
     * @param {() => void} onRun
     * @param {() => void} onText
     * @param {() => number | null} chosen
     * @param {() => number | null} number that of the chosen robot
     */
    constructor(ask, onRun, onText, chosen, number) {
        this.ask = ask;
        this.onRun = onRun;
        this.onText = onText;
        this.chosen = chosen;
        // The path of the scenario and its name.
        /** @type {string | undefined} */
        this.world = undefined;
        /** @type {string | undefined} */
        this.scenario = undefined;
        // The texts with which the run began, by their names.
        /** @type {Texts} */
        this.begun = {};
        /** @type {string[]} */
        this.writable = [];
        this.writes = false;
        // Texts that were typed earlier, and the one of them that is to be shown.
        /** @type {UnsavedText[]} */
        this.unsaved = [];
        /** @type {UnsavedText | null} */
        this.restored = null;
        /** @type {number | undefined} */
        this.keepTimer = undefined;
        /** @type {Texts} */
        this.offered = {};
        this.timer = 0;
        // Each script by its file, also of scenarios that were left: what is written there is not lost.
        /** @type {Map<string, Script>} */
        this.scripts = new Map();
        /** @type {Script | null} */
        this.shown = null;
        // The fault that is marked, and its place.
        /** @type {{ fault: FaultEvent, place: FaultPlace, robot: string } | null} */
        this.marked = null;
        // Styles of the editor's packages get into a shadow tree without an exception from the page's policy.
        const root = part("text").attachShadow({ mode: "open" });
        this.view = new EditorView({ root, parent: root });
        this.marks = new Marks(this, number);
        // The text that is being loaded.
        this.loading = "";
        part("script-name").addEventListener("change", () => this.open(part("script-name").value));
        part("run").addEventListener("click", () => this.run());
        part("load").addEventListener("click", () => this.load());
        part("write").addEventListener("click", () => this.write());
        inside(part("explanation"), "form").addEventListener("submit", () => this.view.focus());
        addEventListener("beforeunload", (event) => {
            this.keep();
            if ([...this.scripts.values()].some((script) => unsavedIn(script) !== null)) {
                this.keepUnsaved();
                event.preventDefault();
            }
        });
    }

    // Returns true if there are texts that were typed earlier and not saved.
    /** @param {World} world */
    begin(world) {
        const { scripts } = world;
        this.keep();
        const before = this.shown && this.shown.world === scripts?.file ? this.shown.name : null;
        // Scenarios have scripts of the same names, but in other folders.
        this.world = scripts?.file;
        this.scenario = scripts?.scenario;
        this.begun = scripts?.begun ?? {};
        const names = scripts ? [...scripts.names, scripts.scenario] : [];
        part("tab-script").hidden = names.length === 0;
        this.writable = scripts?.writable ?? [];
        part("script-name").replaceChildren(...names.map((name) => option(name)));
        this.showFault(null);
        const name = before !== null && names.includes(before) ? before : names[0];
        if (name === undefined || name !== before) {
            this.shown = null;
        }
        if (name !== undefined) {
            part("script-name").value = name;
            // The names that it may use may be others now. What is typed meanwhile stays.
            this.ask({ script: { name } });
        }
        this.marks.begin(this.begun);
        this.unsaved = scripts?.unsaved ?? [];
        this.showUnsaved();
        for (const script of this.scripts.values()) {
            script.unsaved = null;
        }
        this.keepUnsaved();
        return this.unsaved.length > 0;
    }

    /** @param {string} name */
    open(name) {
        this.keep();
        this.shown = null;
        this.ask({ script: { name } });
    }

    // The state of the text that is left.
    keep() {
        if (this.shown) {
            this.shown.state = this.view.state;
        }
    }

    // Asks the session to keep the texts of this world that are in no file.
    keepUnsaved() {
        clearTimeout(this.keepTimer);
        this.keepTimer = undefined;
        this.keep();
        for (const script of this.scripts.values()) {
            const unsaved = unsavedIn(script);
            if (script.world === this.world && unsaved !== script.unsaved) {
                script.unsaved = unsaved;
                this.ask({ unsaved: { name: script.name, text: unsaved, over: script.sha256 } });
            }
        }
    }

    showUnsaved() {
        // The session may offer what this page has: it knows no difference between this one and another one.
        this.unsaved = this.unsaved.filter(({ file, text }) => this.scripts.get(file)?.state.doc.toString() !== text);
        const lines = this.unsaved.map((one) => element("li", {},
            element("span", {}, texts.unsaved(one.name, new Date(1000 * one.seconds)), ...(one.changed ? [element("b", {}, ` ${texts.unsavedOfOther}`)] : [])),
            element("button", { type: "button", title: texts.restoreTextHelp, onclick: () => this.restore(one) }, texts.restoreText),
            element("button", { type: "button", title: texts.discardHelp, onclick: () => this.discard(one) }, texts.discard)));
        part("unsaved").replaceChildren(...lines);
        part("unsaved").hidden = lines.length === 0;
        write(part("tab-script"), lines.length === 0 ? texts.tabScript : texts.unsavedMark);
    }

    /** @param {UnsavedText} one */
    restore(one) {
        this.restored = one;
        if (this.shown?.name === one.name) {
            this.takeRestored();
        } else {
            part("script-name").value = one.name;
            this.open(one.name);
        }
    }

    takeRestored() {
        const one = this.restored;
        if (one && this.shown?.name === one.name) {
            this.restored = null;
            this.replace(one.text);
            // The session forgets it when this page has it.
            this.forget(one);
            this.keepUnsaved();
        }
    }

    /** @param {UnsavedText} one */
    discard(one) {
        this.ask({ discard: { id: one.id } });
        this.forget(one);
    }

    /** @param {UnsavedText} one */
    forget(one) {
        this.unsaved = this.unsaved.filter((other) => other !== one);
        this.showUnsaved();
    }

    // Shows another text. `undo` brings the one before back: an event of this name does not join what was typed just before.
    /** @param {string} text */
    replace(text) {
        this.view.dispatch({ changes: { from: 0, to: this.view.state.doc.length, insert: text }, userEvent: "input.replace" });
    }

    // A message below the text, with actions.
    /**
     * @param {string} text
     * @param {[string, string, () => void][]} actions texts, help and functions
     */
    notice(text, actions) {
        const buttons = actions.map(([name, title, act]) => element("button", {
            type: "button",
            title,
            onclick: () => {
                this.notice("", []);
                act();
            },
        }, name));
        part("changed").replaceChildren(element("span", {}, text), ...buttons);
        part("changed").hidden = text === "";
    }

    /** @param {ScriptEvent} event */
    show({ name, file, text, saved, sha256, words }) {
        const state = () => this.state(text, name === this.scenario);
        const known = this.scripts.get(file)
            ?? { name, file, world: this.world, opened: text, kept: saved, sha256, sent: new Set(), unsaved: null, words, state: state() };
        if (part("script-name").value !== name) {
            // The scenario of a world that is built is held, but not shown.
            name === this.scenario && this.scripts.set(file, known);
            return;
        }
        this.scripts.set(file, known);
        known.words = words;
        if (this.shown !== known) {
            this.shown = known;
            this.view.setState(known.state);
        }
        this.notice("", []);
        // The robots have an earlier text of this editor's, or one from elsewhere: by a link, another page, or on disk.
        const isOther = known.opened !== text && !known.sent.has(text);
        const load = () => {
            if (isOther) {
                this.replace(text);
                known.opened = text;
            }
            Object.assign(known, { kept: saved, sha256 });
        };
        if ([known.kept, saved].includes(this.text)) {
            load();
        } else if (isOther) {
            this.notice(texts.otherText(name), [[texts.loadOther, texts.loadOtherHelp, load]]);
        }
        const isScenario = name === this.scenario;
        part("load").hidden = isScenario;
        part("load-options").hidden = isScenario;
        this.showWrite(name);
        this.take();
        this.takeRestored();
        this.keepUnsaved();
        this.showUnsaved();
        this.check();
        this.onText();
        this.goToMark();
        this.marks.shown();
    }

    // Shows a fault below the text and marks its place, in the script to which that belongs; `null`: no more.
    /**
     * @param {{ fault: FaultEvent, place: FaultPlace, robot: string } | null} marked
     */
    showFault(marked) {
        this.marked = marked;
        part("fault").hidden = !marked;
        if (!marked) {
            // Its answer has the other marks alone.
            this.check();
            return;
        }
        const { fault, place, robot } = marked;
        const open = (/** @type {FaultEvent} */ of, /** @type {FaultPlace} */ at) => this.showFault({ fault: of, place: at, robot });
        part("fault").replaceChildren(
            element("button", { type: "button", title: texts.explainHelp, onclick: () => this.ask({ explain: { code: fault.code } }) }, fault.code),
            element("p", {}, element("b", {}, `${robot}: `), ...faultParts(fault, open, true)),
            element("button", { type: "button", title: texts.hideFault, "aria-label": texts.hideFault, onclick: () => this.showFault(null) }, "×"));
        if (this.shown?.name === place.script) {
            this.check();
            this.goToMark();
        } else if (place.script) {
            part("script-name").value = place.script;
            this.open(place.script);
        }
    }

    // The editor knows no heights of lines while its panel is hidden, and measures by itself 50 ms after it is shown.
    measure() {
        this.view.requestMeasure();
    }

    get mark() {
        const { marked, shown } = this;
        return marked && marked.place.script === shown?.name ? markOf(this.view.state.doc, marked.fault, marked.place) : null;
    }

    // The cursor stays where it is: the user may be typing.
    goToMark() {
        const { mark } = this;
        if (mark) {
            this.view.dispatch({ effects: EditorView.scrollIntoView(mark.from, { y: "center" }) });
        }
    }

    /** @param {string} name */
    showWrite(name) {
        // No server writes scenarios.
        this.writes = this.writable.includes(name);
        write(part("write"), this.writes ? texts.write : texts.download);
        part("write").title = this.writes ? texts.writeHelp : texts.downloadHelp;
    }

    // Scripts by their files take the place of those that are shown, as if they had been typed.
    /** @param {Texts} scripts */
    offer(scripts) {
        this.offered = scripts;
        this.take();
    }

    take() {
        const file = this.shown?.file ?? "";
        const text = this.offered[file];
        if (text !== undefined) {
            delete this.offered[file];
            this.replace(text);
            write(part("script-status"), texts.offered);
        }
    }

    /**
     * @param {string} doc
     * @param {boolean} isScenario
     */
    state(doc, isScenario) {
        const run = () => {
            this.run();
            return true;
        };
        const load = () => {
            this.load();
            return true;
        };
        const write = () => {
            this.write();
            return true;
        };
        return EditorState.create({
            doc,
            extensions: [
                isScenario ? lineNumbers() : statementMarks(() => this.marks.send()), foldGutter(), history(), drawSelection(), indentOnInput(), bracketMatching(), closeBrackets(), highlightActiveLine(),
                // Controls that turn the direction of text could show another script than the one that runs.
                highlightSpecialChars({ addSpecialChars: /[\u202a-\u202e\u2066-\u2069]/g }),
                highlightSelectionMatches(), lintGutter(), theme, syntaxHighlighting(colors), indentUnit.of("    "),
                // A scenario has no names, but the extension: it looks for its state some time after a key, when another text may be shown.
                ...(isScenario ? [] : [buzz, keymap.of([{ key: "F9", run: () => this.marks.toggle() }])]), autocompletion({ override: isScenario ? [] : [completing(() => this.shown?.words ?? [])] }),
                keymap.of([
                    { key: "Mod-Enter", run, shift: load }, { key: "Mod-s", run: write }, ...closeBracketsKeymap, ...defaultKeymap, ...searchKeymap,
                    ...historyKeymap, ...foldKeymap,
                    ...completionKeymap, ...lintKeymap,
                ]),
                // axe-core does not know that an element in which one writes has the focus.
                EditorView.contentAttributes.of({ "aria-label": texts.scriptText, tabindex: "0" }),
                EditorView.updateListener.of(({ docChanged }) => docChanged && this.typed()),
            ],
        });
    }

    // Texts that are not as they were opened, by their files.
    changed() {
        this.keep();
        const changed = [...this.scripts.values()].filter(({ world, opened, state }) => world === this.world && opened !== state.doc.toString());
        return Object.fromEntries(changed.map(({ file, state }) => [file, state.doc.toString()]));
    }

    // `addressOf(scripts)` returns the address of this page with scripts.
    /** @param {(scripts: Texts) => Promise<string>} addressOf */
    async link(addressOf) {
        const address = await addressOf(this.changed());
        window.history.replaceState(null, "", address);
        const isCopied = await navigator.clipboard?.writeText(address).then(() => true, () => false);
        write(part("script-status"), isCopied ? texts.linkedAndCopied : texts.linked);
    }

    typed() {
        write(part("script-status"), "");
        this.onText();
        clearTimeout(this.timer);
        this.timer = setTimeout(() => this.check(), PAUSE);
        this.keepTimer ??= setTimeout(() => this.keepUnsaved(), KEEP);
    }

    get text() {
        return this.view.state.doc.toString();
    }

    check() {
        clearTimeout(this.timer);
        if (this.shown) {
            this.ask({ check: { name: this.shown.name, text: this.text } });
        }
    }

    // The scripts of this world that were opened.
    known() {
        this.keep();
        return [...this.scripts.values()].filter(({ world }) => world === this.world);
    }

    // The texts that are shown, by their names.
    /** @returns {Texts} */
    texts() {
        return Object.fromEntries(this.known().map(({ name, state }) => [name, state.doc.toString()]));
    }

    // True if a text is not the one with which the run began.
    isChanged() {
        return Object.entries(this.texts()).some(([name, text]) => this.begun[name] !== undefined && this.begun[name] !== text);
    }

    // The run starts from the beginning with all texts.
    run() {
        clearTimeout(this.timer);
        this.keepUnsaved();
        this.known().forEach(({ sent, state }) => sent.add(state.doc.toString()));
        this.ask({ run: { texts: this.texts(), keep_changes: part("keep-changes").checked } });
    }

    // The run starts from the beginning with another text of the scenario, which the editor gets as well. `change(text)` returns it, or
    // null if it cannot. Returns false then.
    /** @param {(text: string) => string | null} change */
    runScenario(change) {
        const known = this.known().find(({ name }) => name === this.scenario);
        const changed = change(this.scenarioText());
        if (changed === null || this.scenario === undefined) {
            return false;
        }
        if (known) {
            const changes = { from: 0, to: known.state.doc.length, insert: changed };
            known.state = known.state.update({ changes }).state;
            if (known === this.shown) {
                this.view.dispatch({ changes });
            }
            this.run();
        } else {
            this.ask({ run: { texts: { ...this.texts(), [this.scenario]: changed }, keep_changes: part("keep-changes").checked } });
        }
        return true;
    }

    // The text of the scenario, as it is shown or else as it runs.
    scenarioText() {
        const known = this.known().find(({ name }) => name === this.scenario);
        return known?.state.doc.toString() ?? this.begun[this.scenario ?? ""] ?? "";
    }

    // Gets the text of the scenario, so that changes of it are kept here.
    holdScenario() {
        if (this.scenario !== undefined && !this.known().some(({ name }) => name === this.scenario)) {
            this.ask({ script: { name: this.scenario } });
        }
    }

    // The scenario runs with another text, which the editor gets. Undo brings the one before back.
    /** @param {string} text */
    takeScenario(text) {
        const known = this.known().find(({ name }) => name === this.scenario);
        if (known) {
            known.sent.add(text);
            const before = known.state.doc.toString();
            let [from, end] = [0, 0];
            const most = Math.min(before.length, text.length);
            while (from < most && before[from] === text[from]) {
                from += 1;
            }
            while (end < most - from && before[before.length - 1 - end] === text[text.length - 1 - end]) {
                end += 1;
            }
            const changes = { from, to: before.length - end, insert: text.slice(from, text.length - end) };
            known.state = known.state.update({ changes, userEvent: "input.replace" }).state;
            if (known === this.shown) {
                this.view.dispatch({ changes, userEvent: "input.replace" });
            }
            this.keepUnsaved();
        }
    }

    // Robots get the text while the run goes on.
    load() {
        if (this.shown && this.shown.name !== this.scenario) {
            clearTimeout(this.timer);
            this.keepUnsaved();
            this.shown.sent.add(this.text);
            this.loading = this.text;
            const chosen = part("run-on").value === "one" ? this.chosen() : null;
            const robots = chosen === null ? {} : { robots: [chosen] };
            this.ask({ load: { name: this.shown.name, text: this.text, ...robots, keep: part("keep").checked } });
        }
    }

    /** @param {RanEvent} event */
    ran({ name, draft }) {
        this.marks.ran(name, this.loading);
        write(part("script-status"), texts.ran(draft));
        this.showFault(null);
        this.onRun();
    }

    began() {
        write(part("script-status"), texts.began);
        this.onRun();
    }

    write() {
        if (!this.shown) {
            return;
        }
        const { name, sha256 } = this.shown;
        this.shown.written = this.text;
        if (this.writes) {
            this.ask({ write: { name, text: this.text, over: sha256 } });
        } else {
            save(new Blob([this.text], { type: "text/plain" }), name.replace(/^.*[\\/]/, ""));
            this.written({ name, sha256 });
        }
    }

    /** @param {WrittenEvent} event */
    written({ name, sha256 }) {
        const script = this.named(name);
        if (script) {
            Object.assign(script, { kept: script.written ?? script.kept, sha256 });
            this.keepUnsaved();
        }
        if (this.shown === script) {
            write(part("script-status"), this.writes ? texts.written(name) : "");
        }
    }

    // The text was not written: another program has written the file.
    /** @param {ChangedEvent} event */
    showChanged({ name, saved, sha256 }) {
        const script = this.named(name);
        if (!script || this.shown !== script) {
            return;
        }
        const overwrite = () => this.ask({ write: { name, text: script.written ?? this.text, over: null } });
        const load = () => {
            Object.assign(script, { opened: saved, kept: saved, sha256 });
            this.replace(saved ?? "");
            this.keepUnsaved();
        };
        this.notice(saved === null ? texts.goneOnDisk(name) : texts.changedOnDisk(name), [
            [texts.overwrite, texts.overwriteHelp, overwrite],
            .../** @type {[string, string, () => void][]} */ (saved === null ? [] : [[texts.loadOther, texts.loadOtherHelp, load]]),
        ]);
    }

    // Returns the script of this world with a name.
    /** @param {string} name */
    named(name) {
        return [...this.scripts.values()].find((script) => script.name === name && script.world === this.world);
    }

    // The chosen robot can be the only one that runs a text.
    /** @param {number | null} id */
    choose(id) {
        const [all, one] = [option(texts.runOnAll, "all"), option(texts.runOnOne(id), "one")];
        const before = part("run-on").value;
        part("run-on").replaceChildren(all, ...(id === null ? [] : [one]));
        part("run-on").value = id === null ? "all" : before || "all";
        this.marks.chose();
    }

    // The compiler's messages. The text may have changed since: places are moved into it.
    /** @param {DiagnosticsEvent} event */
    diagnose({ name, diagnostics, problems }) {
        const { shown } = this;
        if (shown?.name !== name) {
            return;
        }
        const { doc } = this.view.state;
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
            return () => this.view.dispatch({ changes });
        };
        const found = diagnostics.map((one) => ({ ...one, fix: fixOf(one), from: isHere(one) ? at(one.line, one.column) : 0 }));
        const marks = found.filter(isHere).map((one) => ({
            from: one.from, to: Math.max(one.from, at(one.end_line, one.end_column)), severity: one.severity, source: one.code,
            message: printable(one.help ? `${one.message}\n${texts.help}: ${one.help}` : one.message),
        }));
        marks.push(...(this.mark ? [this.mark] : []));
        marks.sort((a, b) => a.from - b.from);
        this.view.dispatch(setDiagnostics(this.view.state, marks));
        const explain = (/** @type {string} */ code) => () => this.ask({ explain: { code } });
        const lines = found.map((one) => element("li", { class: one.severity },
            // Mistakes of scenarios have no code, and some have no place.
            ...(one.code ? [element("button", { type: "button", title: texts.explainHelp, onclick: explain(one.code) }, one.code)] : []),
            ...(one.file ? [element("button", { type: "button", class: "place", title: texts.goThere, onclick: () => this.goTo(one.from) },
                isHere(one) ? texts.line(one.line ?? 1) : `${this.shortName(one.file)}:${one.line}`)] : []),
            element("span", {}, one.message, ...(one.help ? [element("small", {}, ` ${one.help}`)] : [])),
            ...(one.fix ? [element("button", { type: "button", title: texts.fixHelp, onclick: one.fix }, texts.fix)] : [])));
        const others = problems.map(({ line, problem }) => element("li", {},
            element("button", { type: "button", class: "place", title: texts.goThere, onclick: () => this.goTo(at(line, 1)) }, texts.line(line)),
            element("span", {}, problem)));
        part("diagnostics").replaceChildren(...lines, ...others);
    }

    // A file in the folder of the scenario has no other name for users.
    /** @param {string} file */
    shortName(file) {
        const folder = this.world?.replace(/[^\\/]*$/, "") ?? "";
        return file.startsWith(folder) ? file.slice(folder.length) : file;
    }

    /** @param {number} place in the text */
    goTo(place) {
        this.view.dispatch({ selection: { anchor: place }, effects: EditorView.scrollIntoView(place, { y: "center" }) });
        this.view.focus();
    }

    /** @param {ExplanationEvent} event */
    explain({ text }) {
        const [heading, ...lines] = text.split("\n");
        write(inside(part("explanation"), "h2"), heading.replace(/^#+ /, ""));
        inside(part("explanation"), "div").replaceChildren(...lines.join("\n").split(/^```\w*$/m).flatMap(explained));
        part("explanation").showModal();
    }
}

// Returns the text of a script if it is in no file.
/** @param {Script} script */
function unsavedIn({ kept, state }) {
    const text = state.doc.toString();
    return text === kept ? null : text;
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
