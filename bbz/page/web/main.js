// The page: the parts, and what passes between them and the session.

import { About } from "./about.js";
import { Builder } from "./builder.js";
import { Controls } from "./controls.js";
import { Curves } from "./curves.js";
import { Editor } from "./editor.js";
import { element, fillTexts, inside, option, part, row, save, showIcon, Tabs, write } from "./element.js";
import { editedPlace, faultParts } from "./fault.js";
import { Grading } from "./grading.js";
import { Ground } from "./ground.js";
import { Log, showMeasures, showTests } from "./log.js";
import { showExplanation, showMessages } from "./messages.js";
import { Notice } from "./notice.js";
import { DisplayOptions } from "./display.js";
import { Pointer } from "./pointer.js";
import { FAILED, Robots } from "./recording.js";
import { RobotPanel } from "./robot.js";
import { withSeed } from "./seed.js";
import { connect } from "./session.js";
import { Stepper } from "./stepper.js";
import { Table } from "./table.js";
import { keepLanguage, language, NAMES, texts } from "./texts.js";
import { TimeLine } from "./timeline.js";
import { Trials } from "./trials.js";
import { View } from "./view.js";

/**
 * @import { CommandDescription, FaultEvent, FaultPlace, LogEvent, StateEvent } from "./events"
 * @import { NoticeKind } from "./notice.js"
 * @import { Ask, Handlers, World } from "./page"
 */

// Milliseconds that a pause may take without a word.
const PAUSING = 80;
// Requests that the page sends without an action of the user, or that change neither run nor texts: an answer to an action stays.
const QUIET = ["inspect", "watch", "unsaved", "script", "explain", "breakpoints"];

const RATES = [0.1, 0.25, 0.5, 1, 2, 5, 10, 20, 50, 100, 1000];

/** @type {World | null} */
let world = null;
/** @type {StateEvent} */
let state = { plays: false, tick: 0, rate: null, over: false };
// The last state of the session was that of a run that plays.
let hasPlayed = false;
// A tick to go to as soon as the one before is reached; `false`: nowhere is being gone to.
/** @type {number | boolean} */
let wanted = false;
// True while new verdicts wait to be shown.
let areVerdictsNew = false;
// The measures that are known, `null` for the others.
/** @type {(number | null)[]} */
let measured = [];
// The timer that says why a pause has to wait.
let pausing = 0;
let defect = "";
// The session does not answer; what it says.
let late = "";
let said = "";
/** @type {NoticeKind} */
let saidKind = "progress";

/** @type {Ask} */
const ask = (request) => {
    // What was refused is about to be mended.
    const kind = typeof request === "string" ? request : Object.keys(request)[0];
    // While the world is built, a text is checked a moment after it was typed, which mends nothing.
    if (saidKind === "answer" && !QUIET.includes(kind) && !(kind === "check" && builder.isOn)) {
        showStatus("");
    }
    session.ask(request);
};
// Recordings, and robots elsewhere, have no more than what is seen anyway.
/** @type {Ask} */
const watch = (request) => {
    if (world && !world.recording && !world.watched) {
        ask(request);
    }
};
const command = (/** @type {string} */ text) => ask({ command: { text } });

fillTexts();
// What was said last is shown again whenever the session answers in time, unless it was closed.
const notice = new Notice(() => {
    [said, saidKind] = ["", "progress"];
});
const robots = new Robots();
const view = new View(part("canvas"));
const table = new Table(robots, choose, () => {
    tabs.show("robot");
    part("tab-robot").focus();
});
const tabs = new Tabs(["about", "robot", "table", "script", "log", "tests", "ground"], (name) => (name === "script" ? editor.measure() : name === "table" && table.choose(view.chosen)));
const panel = new RobotPanel(robots, command, compare, openPlace);
const log = new Log(choose, (code) => ask({ explain: { code } }));
const about = new About(command);
const ground = new Ground(command, ask, () => view.beginCut(), (seed) => {
    if (!editor.runScenario((text) => withSeed(text, seed))) {
        showStatus(texts.noWorld, "answer");
    }
});
const controls = new Controls(command);
const curves = new Curves(view, watch, goTo);
const display = new DisplayOptions(view, curves, watch);
const editor = new Editor(ask, () => builder.began() || state.plays || play(), () => showLights(), () => (view.chosen === null ? null : robots.ids[view.chosen]), () => view.chosen);
const stepper = new Stepper(ask, () => view.chosen, (robot) => robots.ids[robot] ?? robot);
const builder = new Builder(view, editor, ask, {
    say: (text, kind = "answer") => showStatus(text, kind),
    announce,
    onEnter: () => select(null),
    isAtStart: () => state.tick === 0 && !state.plays && world?.commands.length === 0,
});
const trials = new Trials(ask, () => editor.texts());
const grading = new Grading(ask);
const timeLine = new TimeLine(goTo);
new Pointer(view, {
    onChoose: choose,
    onCompare: compare,
    onMove: (robot, at) => panel.move(at, robot),
    onLamp: (lamp, at) => ground.moveLamp(lamp, at),
    onLook: () => display.stopFollowing(),
    onFollow: () => part("follow").click(),
    onCut: (from, to) => ground.cut(view.idsLeftOf(from, to)),
}, builder.hand);

const session = connect({
    onEvent(event) {
        if (event.event === "begin") {
            // The session may come back from another page.
            wait(null);
        }
        const handler = /** @type {((known: typeof event) => void) | undefined} */ (handlers[event.event]);
        if (handler) {
            handler(event);
        } else {
            showDefect(texts.unknownEvent(event.event));
        }
    },
    onSample(bytes) {
        const before = robots.tick;
        const isAnew = robots.take(bytes);
        if (robots.tick < before) {
            log.forget(robots.tick);
            panel.questions.forget(robots.tick);
        }
        view.sampled(isAnew);
        display.sampled();
        showTime();
        panel.show();
        part("robots").classList.toggle("flying", view.hasFliers);
        table.changed();
        builder.sampled();
    },
    onEnd(text) {
        late = "";
        wait(null);
        showStatus(text, "error");
        document.body.classList.add("ended");
    },
    onWait: wait,
    onLate(seconds) {
        late = seconds === null ? "" : texts.late(seconds);
        showStatus(said, saidKind);
    },
});

/** @type {Handlers} */
const handlers = {
    begin(event) {
        let first = 0;
        const groups = event.groups.map((group) => {
            first += group.count;
            return { ...group, first: first - group.count };
        });
        const begun = { ...event, groups };
        world = begun;
        timeLine.begin(begun.end, begun.ticks_per_second);
        begun.events.forEach((seconds) => timeLine.mark("event", seconds * begun.ticks_per_second, texts.eventAt(seconds)));
        log.clear();
        trials.begin(begun);
        grading.begin(begun);
        // The playground has it in its list of examples.
        write(part("scenario"), session.link ? "" : (begun.scripts?.scenario ?? begun.recording?.name ?? ""));
        view.begin(begun, robots);
        builder.begin(begun);
        about.begin(begun);
        panel.begin(begun, view.chosen);
        table.begin(begun);
        ground.begin(begun);
        curves.begin(begun);
        display.begin(begun);
        display.sampled();
        controls.begin(begun.controls ?? []);
        part("stop-on-error").checked = begun.stops_on_error ?? false;
        stepper.begin(begun);
        if (editor.begin(begun)) {
            // Texts that were typed earlier are offered there.
            tabs.show("script");
        }
        showLights();
        measured = [];
        showMeasured();
        editor.choose(view.chosen === null ? null : robots.ids[view.chosen]);
        document.body.classList.toggle("recorded", Boolean(begun.recording));
        document.body.classList.toggle("watched", Boolean(begun.watched));
        if (begun.watched && view.chosen === null) {
            tabs.show("log");
        }
        if (view.chosen !== null) {
            watch({ inspect: { robot: view.chosen } });
        }
        showCommands(begun.commands);
    },
    seeking({ tick, left }) {
        // The button stops it.
        state.plays = true;
        showIcon("play", "pause", texts.pause);
        showStatus(texts.seeking(tick / (world?.ticks_per_second ?? 1), left));
        const next = wanted;
        if (typeof next === "number") {
            wanted = false;
            goTo(next);
        }
    },
    state(event) {
        clearTimeout(pausing);
        if (hasPlayed && !event.plays) {
            announce(texts.pausedAt(clockAt(event.tick)));
        }
        hasPlayed = event.plays;
        const hasEnded = state.over;
        state = event;
        if (hasEnded !== event.over) {
            showMeasured();
        }
        if (event.tick < robots.tick) {
            // The sample of that tick may be skipped.
            log.forget(event.tick);
            panel.questions.forget(event.tick);
        }
        showIcon("play", event.plays ? "pause" : "play", event.plays ? texts.pause : texts.play);
        if (event.plays || event.tick > 0) {
            builder.ran();
        }
        const cut = world?.recording?.cut;
        showStatus(cut ? texts.cut(cut) : event.over ? (world?.watched ? texts.noMore : texts.over) : "", cut ? "error" : "progress");
        controls.follow(world?.commands ?? [], event.tick);
        const next = wanted;
        wanted = false;
        if (typeof next === "number") {
            goTo(next);
        }
        showTime();
    },
    conditions(event) {
        view.lights = event.lights;
        view.poseErrors = event.pose_errors;
        view.changed();
        ground.show(event);
        panel.questions.follow(event.commands);
        about.show(event.lights);
        showCommands(event.commands);
        if (world) {
            world.commands = event.commands;
        }
        showLights();
        controls.follow(event.commands, robots.tick);
    },
    logs({ lost, lines }) {
        if (lost > 0) {
            log.lose(Math.max(robots.tick, 0), lost);
        }
        for (const one of lines) {
            line(one, () => [one.text], one.answer ? "answer" : "");
            if (one.answer) {
                panel.questions.take(one);
            }
        }
    },
    log_cleared() {
        log.clear();
    },
    answers({ lines }) {
        panel.questions.expect(lines);
    },
    fault(event) {
        line(event, () => faultParts(event, openPlace), "fault", event.code);
        timeLine.mark("fault", event.tick, `${texts.robot(robots.ids[event.robot])}: ${event.message}`);
    },
    stopped({ fault, others }) {
        // Who works in a panel, in the middle of a name for example, stays there: the status tells the error.
        const isBusy = part(tabs.shown).contains(document.activeElement);
        (isBusy ? select : choose)(fault.robot);
        const place = editedPlace(fault);
        if (place) {
            (isBusy ? markPlace : openPlace)(fault, place);
        }
        showStatus(texts.stoppedBy(robots.ids[fault.robot], fault.consequence === "contained", others), "error");
    },
    stepped({ at }) {
        if (at) {
            tabs.show("script");
            if (at.robot !== view.chosen) {
                select(at.robot);
            }
        }
        stepper.show(at);
        editor.marks.showStatement(at);
    },
    breakpoints(event) {
        editor.marks.take(event);
    },
    measures({ values }) {
        measured = values;
        showMeasured();
    },
    expectation({ number, verdict, tick }) {
        Object.assign(world?.expectations[number] ?? {}, { verdict, tick });
        // Many may come at once.
        if (!areVerdictsNew) {
            areVerdictsNew = true;
            queueMicrotask(showVerdicts);
        }
    },
    inspection(event) {
        panel.inspect(event);
        if (event.robot === view.chosen) {
            // A robot that failed still has the neighbors in its memory that it had then.
            const senders = new Set(robots.state[event.robot] === FAILED ? [] : panel.neighbors);
            view.estimate = event.estimate;
            view.neighbors = robots.ids.flatMap((id, number) => (senders.has(id) ? [number] : []));
            view.changed();
        }
    },
    attitudes({ robots: attitudes }) {
        view.setAttitudes(attitudes);
        panel.attitudes = attitudes;
    },
    messages(event) {
        view.showMessages(event, state.plays);
    },
    quantity(event) {
        display.paint(event);
    },
    series(event) {
        curves.take(event);
    },
    series_cut(event) {
        // What followed on the way before is void.
        log.forget(event.tick);
        panel.questions.forget(event.tick);
        timeLine.forget("fault", event.tick);
        curves.cut(event);
    },
    series_progress(event) {
        curves.progress(event);
    },
    digest(event) {
        ground.showDigest(event);
    },
    refused({ text, help }) {
        wanted = false;
        const reason = help ? `${text} (${help})` : text;
        if (panel.questions.refused(reason)) {
            return;
        }
        builder.refused();
        trials.refused(reason);
        grading.refused(reason);
        showStatus(reason, "answer");
    },
    script(event) {
        editor.show(event);
    },
    diagnostics(event) {
        showMessages(editor, event);
    },
    ran(event) {
        if (world) {
            world.quantities = event.quantities;
            display.begin(world);
            curves.learn(world);
        }
        controls.begin(event.controls);
        about.ran(event.about);
        editor.ran(event);
    },
    offered({ scripts }) {
        tabs.show("script");
        editor.offer(scripts);
    },
    written(event) {
        editor.written(event);
    },
    changed(event) {
        editor.showChanged(event);
    },
    began() {
        editor.began();
    },
    built(event) {
        builder.built(event);
    },
    trials(event) {
        trials.advanced(event);
        grading.advanced(event);
    },
    trial(event) {
        trials.take(event);
    },
    result(event) {
        trials.handIn(event);
    },
    marks(event) {
        tabs.show("tests");
        grading.take(event);
    },
    explanation(event) {
        showExplanation(event);
    },
    scenario({ text, missing }) {
        save(new Blob([text], { type: "application/toml" }), texts.savedAs);
        if (missing.length > 0) {
            showStatus(texts.missing(missing.join(", ")), "answer");
        }
    },
    // The page asks for scenarios, which have the commands.
    commands() { },
    // Texts that were edited stay in the page.
    defect({ text, help }) {
        showDefect(`${text} (${help})`);
    },
    failed({ text }) {
        showStatus(texts.failed(text), "error");
    },
};

/**
 * @param {string} text
 * @param {NoticeKind} kind
 */
function showStatus(text, kind = "progress") {
    [said, saidKind] = [text, kind];
    notice.show(defect || late || said, defect || late ? "error" : kind);
}

// Shows that another page has the session, and how to take it over; `null`: this page has it.
/** @param {(() => void) | null} takeOver */
function wait(takeOver) {
    document.body.classList.toggle("waiting", takeOver !== null);
    write(inside(part("elsewhere"), "span"), takeOver ? texts.elsewhere : "");
    part("elsewhere").hidden = takeOver === null;
    part("take-over").onclick = takeOver;
}

function showVerdicts() {
    areVerdictsNew = false;
    curves.redraw();
    showLights();
    for (const kind of /** @type {("held" | "failed")[]} */ (["held", "failed"])) {
        timeLine.forget(kind, -1);
        world?.expectations.filter((one) => one.verdict === kind)
            .forEach((one) => timeLine.mark(kind, one.tick ?? 0, `${texts.verdicts[kind]}: ${one.text}`));
    }
}

// Lights are of the texts that are shown, or say that they are not.
function showLights() {
    const isLoaded = world?.commands.some(({ text }) => /^load\b/.test(text));
    showTests(world?.expectations ?? [], isLoaded ? "loaded" : editor.isChanged() ? "edited" : null);
}

function showMeasured() {
    showMeasures(world?.measures ?? [], measured, state.over);
}

// A defect of bbz stays in sight.
/** @param {string} text */
function showDefect(text) {
    defect = text;
    showStatus("");
}

// Chooses a robot and shows its panel, unless the script or the table of all robots is in sight.
/** @param {number | null} robot */
function choose(robot) {
    select(robot);
    if (tabs.shown !== "script" && tabs.shown !== "table") {
        tabs.show("robot");
    }
}

/** @param {number | null} robot */
function select(robot) {
    view.choose(robot);
    curves.changed();
    panel.choose(robot);
    panel.showCompared(view.compared);
    editor.choose(robot === null ? null : robots.ids[robot]);
    table.choose(robot);
    watch({ inspect: { robot } });
    announce(robot === null ? texts.noRobotNow : robotInWords(robot));
}

/** @param {number} robot */
function robotInWords(robot) {
    const place = texts.placeOf(robots.x[robot] / 10, robots.y[robot] / 10, robots.z[robot] / 10, (robots.heading[robot] * 360) / 65536);
    return texts.announced(robots.ids[robot], texts.states[robots.state[robot]], world?.watched ? [] : [place, texts.ledIs(robots.led[robot])]);
}

// Says to a screen reader what the picture shows.
/** @param {string} text */
function announce(text) {
    write(part("announced"), text);
}

/** @param {number} tick */
function clockAt(tick) {
    const perSecond = world?.ticks_per_second ?? 1;
    return world?.watched ? texts.seconds(tick / perSecond) : texts.clock(tick / perSecond, (world?.end ?? 0) / perSecond);
}

// Shows the curve of a robot next to others, or hides it.
/** @param {number} robot */
function compare(robot) {
    showStatus(view.compare(robot) ? "" : texts.comparedMax, "answer");
    panel.showCompared(view.compared);
    curves.changed();
}

// Shows the place of a fault in the editor.
/**
 * @param {FaultEvent} fault
 * @param {FaultPlace} place
 */
function openPlace(fault, place) {
    tabs.show("script");
    markPlace(fault, place);
}

// Marks the place of a fault in the editor.
/**
 * @param {FaultEvent} fault
 * @param {FaultPlace} place
 */
function markPlace(fault, place) {
    const robot = texts.robotAt(robots.ids[fault.robot], fault.tick / (world?.ticks_per_second ?? 1));
    editor.showFault({ fault, place, robot });
}

function play() {
    const rate = Number(part("rate").value);
    if (!state.plays) {
        ask({ play: rate > 0 ? { rate } : {} });
        return;
    }
    ask("pause");
    // A tick of a large world takes a while.
    state.plays = false;
    showIcon("play", "play", texts.play);
    clearTimeout(pausing);
    pausing = setTimeout(() => showStatus(texts.pausing), PAUSING);
}

// One jump at a time: a drag of the time line leads to its last place.
/** @param {number} tick */
function goTo(tick) {
    const inside = Math.max(0, Math.min(world?.end ?? 0, tick));
    if (wanted === false) {
        wanted = true;
        ask({ go_to: { tick: inside } });
    } else {
        wanted = inside;
    }
}

function step() {
    ask({ step: { ticks: 1 } });
}

function showTime() {
    if (!world) {
        return;
    }
    const tick = Math.max(robots.tick, 0);
    timeLine.show(tick, state.plays, clockAt(tick));
    curves.show(tick);
    write(part("clock"), clockAt(tick));
}

/** @param {CommandDescription[]} commands */
function showCommands(commands) {
    timeLine.forget("command", -1);
    for (const { tick, text } of commands) {
        timeLine.mark("command", tick, text);
    }
}

/**
 * @param {Pick<LogEvent, "tick" | "robot">} event
 * @param {() => (string | Node)[]} content
 * @param {string} kind
 * @param {string} [code]
 */
function line({ tick, robot }, content, kind, code) {
    log.add(tick, tick / (world?.ticks_per_second ?? 1), robot, robots.ids[robot] ?? robot, content, kind, code);
}

for (const rate of RATES) {
    part("rate").append(option(texts.rateOf(rate), String(rate), rate === 1));
}
part("rate").append(option(texts.asFast, "0"));
// The page is loaded anew in the other language; it asks before a text is lost.
part("language").append(...NAMES.map(([name, text]) => option(text, name, name === language)));
part("language").onchange = () => {
    keepLanguage(part("language").value);
    location.reload();
};
inside(part("help"), "dl").append(...texts.allKeys.map(([key, text]) => row(element("kbd", {}, key), text)));

const [goBack, goHome, showHelp] = [() => goTo(robots.tick - 1), () => goTo(0), () => part("help").showModal()];
/** @type {Record<string, () => void>} */
const acts = { " ": play, ",": goBack, ".": step, Home: goHome, "?": showHelp, b: () => builder.toggle() };
part("save").onclick = () => ask("scenario");
part("keys").onclick = showHelp;
// The playground has these.
const { link, exportPage } = session;
part("link").hidden = !link;
part("link").onclick = () => link && editor.link(link);
part("export").hidden = !exportPage;
part("export").onclick = async () => {
    const text = await exportPage?.(editor.changed()) ?? "";
    save(new Blob([text], { type: "text/html" }), texts.exportedAs);
};
part("start").onclick = goHome;
part("back").onclick = goBack;
part("play").onclick = play;
part("step").onclick = step;
part("stop-on-error").onchange = () => ask({ stop_on_error: { on: part("stop-on-error").checked } });
part("rate").onchange = () => {
    if (state.plays) {
        state.plays = false;
        play();
    }
};
addEventListener("keydown", (event) => {
    const target = /** @type {Element} */ (event.target);
    const isTyped = target.matches("input, select, textarea, #text") || event.ctrlKey || event.metaKey || event.altKey;
    // The space bar presses a button that has the focus.
    const isPressed = event.key === " " && target.matches("button, summary");
    if (acts[event.key] && !isTyped && !isPressed && !document.querySelector("dialog[open]")) {
        event.preventDefault();
        acts[event.key]();
    }
});
