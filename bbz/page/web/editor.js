// The editor of the scenario's scripts.

import { stateOf } from "./editor-state.js";
import { element, inside, option, part, save, write } from "./element.js";
import { faultParts, markOf } from "./fault.js";
import { Marks } from "./marks.js";
import { texts } from "./texts.js";
import { Unsaved } from "./unsaved-texts.js";
import { EditorView } from "./vendor.js";
// Milliseconds from the last key until the compiler checks the text.
const PAUSE = 150;

/**
 * @import {
 *   ChangedEvent, FaultEvent, FaultPlace, RanEvent, ScriptEvent, Word, WrittenEvent,
 * } from "./events"
 * @import { TextActs } from "./editor-state.js"
 * @import { EditorState } from "./vendor.js"
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
        this.unsaved = new Unsaved(this);
        /** @type {TextActs} */
        this.acts = {
            run: () => this.run(), load: () => this.load(), write: () => this.write(), typed: () => this.typed(), toggleMark: () => this.marks.toggle(),
            moveMarks: () => this.marks.send(), words: () => this.shown?.words ?? [],
        };
        // The text that is being loaded.
        this.loading = "";
        part("script-name").addEventListener("change", () => this.open(part("script-name").value));
        part("run").addEventListener("click", () => this.run());
        part("load").addEventListener("click", () => this.load());
        part("write").addEventListener("click", () => this.write());
        inside(part("explanation"), "form").addEventListener("submit", () => this.view.focus());
        addEventListener("beforeunload", (event) => {
            if (this.unsaved.isAny()) {
                this.unsaved.keep();
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
        return this.unsaved.begin(scripts?.unsaved ?? []);
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
        const state = () => stateOf(text, name === this.scenario, this.acts);
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
        this.unsaved.takeRestored();
        this.unsaved.keep();
        this.unsaved.show();
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
        this.unsaved.keepSoon();
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
        this.unsaved.keep();
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
            this.unsaved.keep();
        }
    }

    // Robots get the text while the run goes on.
    load() {
        if (this.shown && this.shown.name !== this.scenario) {
            clearTimeout(this.timer);
            this.unsaved.keep();
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
            this.unsaved.keep();
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
            this.unsaved.keep();
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

    /** @param {number} place in the text */
    goTo(place) {
        this.view.dispatch({ selection: { anchor: place }, effects: EditorView.scrollIntoView(place, { y: "center" }) });
        this.view.focus();
    }
}
