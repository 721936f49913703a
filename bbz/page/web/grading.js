// Files that were handed in, which a teacher chooses or drops on the page, and their marks.

import { element, part, saveTable, write } from "./element.js";
import { texts } from "./texts.js";

/**
 * @import { Mark, MarksEvent, TrialsEvent } from "./events"
 * @import { Ask, World } from "./page"
 */

// The most bytes of a file, as in `bbz grade`.
const BYTES_MAX = 16 * 1024 * 1024;

export class Grading {
    /** @param {Ask} ask */
    constructor(ask) {
        this.ask = ask;
        this.isOpen = false;
        this.status = element("p", { role: "status" });
        this.result = element("div");
        document.addEventListener("dragover", (event) => {
            if (this.isOpen && event.dataTransfer?.types.includes("Files")) {
                // Otherwise the browser would leave the page for the file.
                event.preventDefault();
                part("grading").classList.add("target");
            }
        });
        document.addEventListener("dragleave", () => part("grading").classList.remove("target"));
        document.addEventListener("drop", (event) => {
            part("grading").classList.remove("target");
            if (this.isOpen && event.dataTransfer && event.dataTransfer.files.length > 0) {
                event.preventDefault();
                void this.grade([...event.dataTransfer.files]);
            }
        });
    }

    /** @param {World} world */
    begin(world) {
        this.isOpen = world.assignment !== null && Boolean(world.scripts);
        part("grading").hidden = !this.isOpen;
        const files = element("input", {
            type: "file", accept: ".json,application/json", multiple: "", "aria-label": texts.grade, hidden: "",
            onchange: () => void this.grade([...(files.files ?? [])]).then(() => {
                // The same files can be chosen again.
                files.value = "";
            }),
        });
        part("grading").replaceChildren(files,
            element("button", { type: "button", title: texts.gradeHelp, onclick: () => files.click() }, texts.grade), this.status, this.result);
    }

    /** @param {File[]} files */
    async grade(files) {
        if (files.length === 0) {
            return;
        }
        const large = files.find((file) => file.size > BYTES_MAX);
        if (large) {
            write(this.status, texts.tooLarge(large.name));
            return;
        }
        write(this.status, texts.grading);
        this.result.replaceChildren();
        /** @type {Record<string, string>} */
        const named = {};
        for (const file of files) {
            // Files of two folders may have one name.
            let name = file.name;
            for (let number = 2; name in named; number += 1) {
                name = `${file.name} (${number})`;
            }
            named[name] = await file.text();
        }
        this.ask({ grade: { files: named } });
    }

    /** @param {MarksEvent} event */
    take({ marks, csv }) {
        write(this.status, "");
        const head = element("tr", {}, ...texts.marksHead.map((text) => element("th", { scope: "col" }, text)));
        this.result.replaceChildren(
            element("table", {}, element("thead", {}, head), element("tbody", {}, ...marks.map(row))),
            element("button", { type: "button", onclick: () => saveTable(csv, texts.marksAs) }, texts.saveMarks));
    }

    /** @param {TrialsEvent} event */
    advanced({ percent }) {
        if (this.status.textContent !== "") {
            write(this.status, percent < 100 ? `${texts.grading} ${texts.percentDone(percent)}` : "");
        }
    }

    /** @param {string} reason */
    refused(reason) {
        if (this.status.textContent !== "") {
            write(this.status, reason);
        }
    }
}

/** @param {Mark} mark */
function row({ file, reason, ran }) {
    const held = ran?.expectations.filter((one) => one.held).length ?? 0;
    const count = ran?.expectations.length ?? 0;
    const notes = [
        ...(ran && !ran.success && held === count ? [texts.scriptError] : []),
        ...(reason === null ? [] : [reason.trimEnd()]),
        ...(ran && ran.same_scripts.length > 0 ? [texts.sameAs(ran.same_scripts.join(", "))] : []),
    ];
    const verdict = ran ? texts.heldOf(held, count) : texts.notRun;
    const lines = (/** @type {string[]} */ list) => list.map((text) => element("div", {}, text));
    const cells = [lines(ran ? [ran.by, file] : [file]), [verdict], lines(notes)];
    return element("tr", {}, ...cells.map((parts) => element("td", {}, ...parts)));
}
