// Questions to the chosen robot: a field for an expression or a call of its script, and the answers.

import { element } from "./element.js";
import { texts } from "./texts.js";

/**
 * @import { CommandDescription, LogEvent } from "./events"
 */

// Answers that are kept.
const ANSWERS_MAX = 200;

export class Questions {
    // `command(text)` gives a command.
    /** @param {(text: string) => void} command */
    constructor(command) {
        this.command = command;
        this.ticksPerSecond = 10;
        /** @type {number | null} */
        this.robot = null;
        this.id = 0;
        /** @type {LogEvent[]} */
        this.answers = [];
        // The answers that come with the next tick.
        /** @type {LogEvent[]} */
        this.coming = [];
        // The command that the session has not accepted yet, and its question.
        this.sent = "";
        this.question = "";
        /** @type {string[]} */
        this.history = [];
        this.place = 0;
        this.field = element("input", {
            type: "text", class: "code", autocomplete: "off", autocapitalize: "off", spellcheck: "false", maxlength: 2000,
            "aria-label": texts.askLabel, placeholder: texts.askExample,
            onkeydown: (/** @type {KeyboardEvent} */ event) => this.recall(event),
        });
        this.refusal = element("p", { class: "refusal", role: "alert", hidden: "" });
        this.list = element("ol", { class: "answers", role: "log", "aria-label": texts.answers, tabindex: 0, hidden: "" });
        this.element = element("section", { class: "ask" },
            element("form", { class: "place", onsubmit: (/** @type {Event} */ event) => this.ask(event) },
                this.field, element("button", { title: texts.askHelp }, texts.ask)),
            this.refusal, this.list);
    }

    /** @param {number} ticksPerSecond */
    begin(ticksPerSecond) {
        this.ticksPerSecond = ticksPerSecond;
        this.answers = [];
        this.coming = [];
        this.sent = "";
        this.show();
    }

    /**
     * @param {number | null} robot
     * @param {number} id
     */
    choose(robot, id) {
        this.robot = robot;
        this.id = id;
        this.refusal.hidden = true;
        this.show();
    }

    /** @param {Event} event */
    ask(event) {
        event.preventDefault();
        const question = this.field.value.trim();
        if (question === "" || this.robot === null) {
            return;
        }
        if (this.history[this.history.length - 1] !== question) {
            this.history.push(question);
        }
        this.place = this.history.length;
        this.refusal.hidden = true;
        this.question = question;
        this.sent = `robots = ${this.id}\nask = ${JSON.stringify(question)}`;
        this.command(this.sent);
    }

    // Shows an earlier question, as a terminal does.
    /** @param {KeyboardEvent} event */
    recall(event) {
        const step = { ArrowUp: -1, ArrowDown: 1 }[event.key];
        if (step === undefined) {
            return;
        }
        event.preventDefault();
        this.place = Math.max(0, Math.min(this.history.length, this.place + step));
        this.field.value = this.history[this.place] ?? "";
    }

    // The commands of the session have changed.
    /** @param {CommandDescription[]} commands */
    follow(commands) {
        if (this.sent !== "" && commands.some(({ text }) => text === this.sent)) {
            this.sent = "";
            // The next question may be there already.
            if (this.field.value.trim() === this.question) {
                this.field.value = "";
            }
            this.place = this.history.length;
        }
    }

    // Shows the reason if a question was refused. Returns false if something else was.
    /** @param {string} reason */
    refused(reason) {
        if (this.sent === "") {
            return false;
        }
        this.sent = "";
        this.refusal.replaceChildren(element("span", {}, reason));
        this.refusal.hidden = false;
        return true;
    }

    /** @param {LogEvent} answer */
    take(answer) {
        // The lines before the tick to which the run went back come again.
        if (this.answers.some(({ tick, robot, text }) => tick === answer.tick && robot === answer.robot && text === answer.text)) {
            return;
        }
        this.answers.push(answer);
        this.answers.splice(0, this.answers.length - ANSWERS_MAX);
        this.coming = this.coming.filter(({ tick, robot }) => tick > answer.tick || robot !== answer.robot);
        this.show();
    }

    /** @param {LogEvent[]} answers those that come with the next tick */
    expect(answers) {
        this.coming = answers;
        this.show();
    }

    // Forgets what comes again when the run goes on from a tick.
    /** @param {number} tick */
    forget(tick) {
        this.answers = this.answers.filter((answer) => answer.tick < tick);
        this.show();
    }

    show() {
        const answers = [...this.answers, ...this.coming].filter(({ robot }) => robot === this.robot).reverse();
        this.list.hidden = answers.length === 0;
        this.list.replaceChildren(...answers.map(({ tick, text, answer }) => element("li", { class: answer === "missing" ? "missing" : "" },
            element("time", {}, (tick / this.ticksPerSecond).toFixed(1)), element("code", {}, text))));
    }
}
