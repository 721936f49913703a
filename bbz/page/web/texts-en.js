// All texts of the page, in English.

/**
 * @import { AttitudeDescription, FaultPlace, LinkDescription, MessageDescription, NeighborDescription, ResultEvent } from "./events"
 */

// Four digits, without the zeros that end a fraction.
const numberText = (/** @type {number} */ value) => (Number.isInteger(value) ? String(value) : String(Number(value.toPrecision(4))));

// By the sum of 1 for red, 2 for green and 4 for blue.
const COLORS = ["off", "red", "green", "yellow", "blue", "magenta", "cyan", "white"];
const ledName = (/** @type {number} */ led) => COLORS[led];

/** @type {Record<string, string>} */
const MEDIA = { ir: "Infrared", nrf24: "nRF24", p2p: "P2P", rab: "Range and bearing" };

export const english = {
    controls: "run", play: "Play", pause: "Pause", playHelp: "Play or pause (space)",
    home: "To the beginning (Home)", back: "A tick back (,)", step: "A tick forward (.)",
    rate: "Speed", asFast: "as fast as it can", rateOf: (/** @type {number} */ rate) => `${rate} ×`,
    save: "Save as scenario", saveHelp: "A scenario file with its scripts, which replays this session from any folder",
    missing: (/** @type {string} */ names) => `The saved scenario needs these files next to it, because they are no texts: ${names}`,
    clock: (/** @type {number} */ seconds, /** @type {number} */ end) => `${seconds.toFixed(1)} s of ${end.toFixed(1)} s`, time: "Time of the run", marks: "Marks of the run: arrow keys lead from one to the next",
    markAt: (/** @type {number} */ seconds, /** @type {string} */ text) => `${seconds.toFixed(1)} s: ${text}`,
    over: "The run is over.", cut: (/** @type {string} */ reason) => `The recording ends early: ${reason}.`,
    away: "The session has ended. Start it again in the terminal.",
    awayFromNotebook: "The session has ended. Run the cell of the notebook again.",
    elsewhere: "Another page shows this session now. What you do here has no effect.",
    takeOver: "Continue here", takeOverHelp: "This page gets the session from the other one",
    late: (/** @type {number} */ seconds) => `The session has not answered for ${seconds.toFixed(0)} s: it computes, or the computer is busy.`,
    broken: "The playground does not start: its files cannot be loaded. Load the page again.",
    moduleDefect: (/** @type {string} */ version, /** @type {string} */ reason) => `defect of bbz ${version}: ${reason}`,
    moduleAdvice: "your files are not the cause; what you wrote is still in the editor: download it, report this line with your steps, then load the page again",
    failed: (/** @type {string} */ text) => `The run cannot go on: ${text}`,
    unknownEvent: (/** @type {string} */ name) => `The page does not know the event "${name}" of the session: this is a defect of bbz.`,
    closeNotice: "Close this message (Esc)",
    example: "Example",

    keys: "Keys and language", close: "Close",
    language: "Language", ofEnglish: "Messages of the compiler, scripts and the book are in English; the lessons are in French, too.",
    allKeys: [
        ["Space", "play or pause"], [",  .", "a tick back, a tick forward"], ["Home", "to the beginning"],
        ["Tab", "from one part of the page to the next"],
        ["n  p", "in the world: the next robot, the one before"], ["f", "in the world: follow the chosen robot, or no more"], ["Esc", "in the world: no robot"],
        ["Shift + click", "on a robot: compares its curve with others"], ["c", "in the world: compares the chosen robot, or no more"],
        ["Shift + arrows", "in the world: moves the chosen robot by 10 mm"],
        ["Ctrl + arrows", "in the world in 3-D: turn and tilt it"],
        ["Ctrl + Enter", "in the script: run from the beginning with the text"], ["Ctrl + S", "in the script: save it"],
        ["Shift + Ctrl + Enter", "in the script: load the text now, while the run goes on"],
        ["F8  F10  Shift + F8", "line by line: the next statement, past calls, out of the function"], ["F7", "line by line: the statement before"], ["F9", "in the script: a breakpoint, or none"],
        ["Arrows  +  −  0  r", "in the world: move the view, zoom, show all, show the robots"],
        ["b", "build the world, or end that"], ["1 to 8", "while building: the tools"], ["n  p", "while building: the next thing, the one before"],
        ["Enter", "while building, in the world: adds a thing"], ["Arrows  r  R  Del", "while building: move, turn and delete the chosen thing; Shift + arrows by 1 mm"],
        ["Ctrl + C  V  D", "while building: copy, paste, both"], ["Ctrl + Z  Y", "while building: undo, redo"],
    ],

    build: "Build", buildHelp: "Build the start of the world by hand; each change is one of the scenario's text (b)", buildLabel: "building the world",
    buildStarts: "The run starts from the beginning.",
    buildOn: "Building the world. Keys 1 to 8: tools. n and p: things.", buildOff: "The world is not built any more.",
    hintBuild: {
        choose: "Click a thing, drag it or its handles. Arrows, r and Del move, turn and delete it; Shift: exactly.",
        robot: "Click where a robot is to stand, or press Enter.", wall: "Drag a wall, or press Enter.", box: "Drag a box, or press Enter.",
        disc: "Drag a disc from its center, or press Enter.", puck: "Drag a disc that robots can push from its center, or press Enter.",
        lamp: "Click where a lamp is to be, or press Enter.", paint: "Drag a painted box, or press Enter.",
    },
    toolsLabel: "tools", tools: { choose: "Choose", robot: "Robot", wall: "Wall", box: "Box", disc: "Disc", puck: "Puck", lamp: "Lamp", paint: "Paint" },
    toolHelp: {
        choose: "Choose, drag and turn things (1)", robot: "A click adds a robot (2)", wall: "A drag draws a wall (3)",
        box: "A drag draws a box (4)", disc: "A drag draws a disc (5)", puck: "A drag draws a disc that robots push (6)",
        lamp: "A click adds a lamp (7)", paint: "A drag paints a box on the ground (8)",
    },
    groupOfNew: "group of new robots", thingsLabel: "things in the world", noThing: "choose a thing",
    thingKinds: { robot: "Robots", obstacle: "Obstacles", movable: "Pucks, which robots push", lamp: "Lamps", patch: "Paint" },
    /** @type {(form: "robot" | "wall" | "box" | "disc" | "movable" | "lamp" | "patch", number: number) => string} */
    thing: (form, number) => `${{ robot: "Robot", wall: "Wall", box: "Box", disc: "Disc", movable: "Puck", lamp: "Lamp", patch: "Paint" }[form]} ${number}`,
    valueNames: { x: "x", y: "y", fromX: "from x", fromY: "y", toX: "to x", toY: "y", radius: "r", width: "w", height: "h", heading: "°", brightness: "bright" },
    valueLabels: {
        x: "x in mm", y: "y in mm", fromX: "first end: x in mm", fromY: "first end: y in mm", toX: "second end: x in mm", toY: "second end: y in mm",
        radius: "radius in mm", width: "width in mm", height: "height in mm", heading: "direction in degrees", brightness: "brightness",
    },
    copyThing: "Copy", copyThingHelp: "Another one beside it (Ctrl + D)", deleteThing: "Delete", deleteThingHelp: "Out of the world (Del)",
    turnLeft: "⟲", turnLeftHelp: "Turn left by 15° (r)", turnRight: "⟳", turnRightHelp: "Turn right by 15° (R)",
    undoBuild: "Undo", undoBuildHelp: "The text of the scenario before the last change (Ctrl + Z)", redoBuild: "Redo", redoBuildHelp: "The change again (Ctrl + Y)",
    buildDone: "Done", buildDoneHelp: "End building (Esc)",
    noDirection: "It has no direction.", deleted: "Deleted", copied: (/** @type {string} */ name) => `${name} is copied: Ctrl + V adds it.`,
    undone: "Undone", redone: "Done again", noUndo: "No change is left to undo.", noRedo: "No change is left to do again.",
    typedSince: "The scenario's text was typed in since: undo in the editor.",

    canvas: "The world, seen from above. Keys: question mark",
    hint: "Click a robot to look into it. Drag robots, lamps or the ground; zoom with the wheel.",
    hintWatched: "Robots that report. Where they are is not known.", noMore: "The trace has ended.", seconds: (/** @type {number} */ seconds) => `${seconds.toFixed(1)} s`,
    wind: (/** @type {string} */ speed) => `wind ${speed} mm/s`,
    display: "how the world is shown", color: "Color by", byState: "state", byGroup: "group", messages: "Messages", trails: "Trails",
    stopOnError: "Stop on error", stopOnErrorHelp: "The run pauses when a script has an error, and the editor shows its place",
    tilt: "3-D", tiltHelp: "Seen from a side. Turn it with the right mouse button, or Ctrl + arrows",
    picture: "Picture", pictureHelp: "Saves what is shown as a PNG file", pictureAs: "bittybuzz.png",
    drawing: "Drawing", drawingHelp: "Saves the world as an SVG file", drawingAs: "bittybuzz.svg",
    quantities: { plot: "of the scenario", robot: "each robot", swarm: "the swarm", global: "globals" },
    addCurve: "Add curve", addCurveLabel: "add the curve of a quantity",
    curveLabel: (/** @type {string} */ name) => `${name} over time`,
    /** @type {(time: string, five: number[], isSingle: boolean) => string} */
    curve: (time, five, isSingle) => {
        const [a, b, c, d, e] = five.map((value) => (Number.isFinite(value) ? numberText(value) : "none"));
        return isSingle || c === "none" ? `at ${time}: ${c}` : `at ${time}: median ${c}, half ${b} to ${d}, all ${a} to ${e}`;
    },
    inUnit: (/** @type {string} */ name, /** @type {string} */ unit) => `${name} in ${unit}`,
    noPoint: (/** @type {string} */ time) => `at ${time}: not known`,
    scales: { all: "all values", clipped: "clipped", log: "logarithmic" },
    scaleOf: (/** @type {string} */ name) => `scale of ${name}`,
    above: (/** @type {number} */ value) => `↑ up to ${numberText(value)}`, below: (/** @type {number} */ value) => `↓ down to ${numberText(value)}`,
    timeTick: (/** @type {number} */ seconds) => `${numberText(seconds)} s`,
    nothingPositive: "A logarithmic scale shows numbers above 0 only.", noNumbers: "No robot has a number here.",
    csv: "CSV", saveCurve: (/** @type {string} */ name) => `Save ${name} as CSV`, saveCurveHelp: "Saves the points as a table (CSV)",
    closeCurve: (/** @type {string} */ name) => `Close the curve of ${name}`,
    curveColumns: { time: "time in s", value: "value", five: ["min", "lower quartile", "median", "upper quartile", "max"] },
    curveAs: (/** @type {string} */ name) => `${name.replaceAll(/[^\w.-]+/g, "_").replace(/_$/, "")}.csv`,
    computingPast: (/** @type {number} */ percent) => `The past of the curves is computed: ${percent} %.`,
    pastStopped: (/** @type {number} */ percent) => `The past of the curves is known to ${percent} %.`,
    pastUnknown: (/** @type {string} */ reason) => `The past of the curves is not known: ${reason}.`,
    stopCurves: "Stop", stopCurvesHelp: "Computes no more of the past", goOnCurves: "Go on", goOnCurvesHelp: "Computes the rest of the past",
    curveOf: (/** @type {number | null} */ id, /** @type {number} */ value) => `robot ${id}: ${numberText(value)}`,
    number: numberText,
    bar: (/** @type {number} */ low, /** @type {number} */ high, /** @type {string} */ robots) => `${numberText(low)} to ${numberText(high)}: ${robots}`,
    histogram: (/** @type {number[]} */ counts) => `robots from the least value to the greatest, in ${counts.length} equal parts: ${counts.join(", ")}`,
    labels: "Labels", labelsHelp: "The ids of robots, and letters for the colors of their LEDs, where there is room",
    follow: "Follow", followHelp: "Keeps the chosen robot in the middle (f)",
    fitRobots: "Fit robots", fitRobotsHelp: "Shows all robots as large as there is room (r)",
    tabAbout: "About",
    colorsOf: (/** @type {string} */ script) => `Colors of ${script}`, scriptOf: (/** @type {string} */ script) => `Script ${script}`,
    colors: COLORS, colorLetters: ["", "R", "G", "Y", "B", "M", "C", "W"],
    lights: "Lamps", lightAt: (/** @type {number} */ x, /** @type {number} */ y, /** @type {number} */ brightness) => `Lamp at (${x}, ${y}) mm, brightness ${brightness}`,
    tries: "Things to try",
    countOf: (/** @type {number} */ count, /** @type {string} */ robot) => (robot ? `${count} × ${robot}` : `${count} ${count === 1 ? "robot" : "robots"}`),
    idsOf: (/** @type {number} */ first, /** @type {number} */ last) => (first === last ? `id ${first}` : `ids ${first} to ${last}`),
    runs: (/** @type {string} */ script) => `script ${script}`,
    rangeOf: (/** @type {LinkDescription} */ { medium, range, is_between_rims: isBetweenRims }) => {
        const name = MEDIA[medium] ?? medium;
        return range === null ? `${name} without a limit of range` : `${name} within ${numberText(range)} mm${isBetweenRims ? " from rim to rim" : ""}`;
    },
    led: "LED", range: "Range", attitude: "Attitude",
    ledOf: (/** @type {number} */ color, /** @type {string} */ meaning) => (meaning ? `${COLORS[color]}: ${meaning}` : COLORS[color]),
    attitudeOf: (/** @type {AttitudeDescription} */ { roll, pitch, thrust }) => `roll ${Math.round(roll)}°, pitch ${Math.round(pitch)}°, thrust ${Math.round(thrust)} %`,
    tabRobot: "Robot", tabTable: "Table", tabScript: "Script", tabLog: "Log", tabTests: "Tests", tabGround: "World",

    allRobots: "All robots: arrow keys choose one, Enter shows more about it", robotsHead: ["Id", "State", "x", "y", "z", "LED"],
    noRobotNow: "No robot is chosen.",
    /** @type {(id: number | null, state: string, seen: string[]) => string} */
    announced: (id, state, seen) => `Robot ${id}, ${[state, ...seen].join(", ")}`,
    pausedAt: (/** @type {string} */ clock) => `Paused at ${clock}`,
    noRobot: "No robot is chosen. Click one in the world, or press n there. Table lists all of them.",
    robot: (/** @type {number | null} */ id) => `Robot ${id}`,
    state: "State", states: ["running", "stopped", "failed", "stopped by an error"],
    group: "Group", script: "Script", place: "Place", memory: "Memory",
    placeOf: (/** @type {number} */ x, /** @type {number} */ y, /** @type {number} */ z, /** @type {number} */ degrees) => `(${x.toFixed(1)}, ${y.toFixed(1)}${z ? `, ${z.toFixed(1)}` : ""}) mm, ${Math.round(degrees) % 360}°`,
    ledName, ledIs: (/** @type {number} */ led) => `LED ${ledName(led)}`,
    radius: "Radius", radiusOf: (/** @type {number} */ mm) => `${mm} mm`,
    estimate: "Estimate",
    /** @type {(x: number, y: number, z: number, away: number) => string} */
    estimateOf: (x, y, z, away) => `${Math.round(x)}, ${Math.round(y)}, ${Math.round(z)} mm (${Math.round(away)} mm away)`,
    battery: "Battery",
    /** @type {(millivolts: number, charge: number | null) => string} */
    batteryOf: (millivolts, charge) => `${(millivolts / 1000).toFixed(2)} V${charge === null ? "" : `, ${Math.round(charge * 100)} % left`}`,
    memoryOf: (/** @type {number} */ used, /** @type {number} */ all) => `${used} of ${all} slots`,
    fail: "Fail", failHelp: "No motor, no message, no step until it is restarted",
    stop: "Stop", stopHelp: "No motor, no message, no step until it resumes",
    resume: "Resume", resumeHelp: "A stopped robot goes on where it was",
    restart: "Restart", restartHelp: "Off and on: the script begins anew",
    compare: "Compare", compareHelp: "Shows its curve beside those of other robots: six at most", comparedMax: "Six robots are compared already: leave one out.",
    ask: "Ask", askHelp: "The robot evaluates the expression or call now and shows the value. Up and Down show earlier ones.",
    askLabel: "Expression or call to ask the robot", askExample: "n + 1, led(3), v.get(\"key\")", answers: "Answers",
    block: "Cut off", blockHelp: "No message gets to it or from it",
    restore: "Reconnect", restoreHelp: "Its blocked links work again",
    x: "x in mm", y: "y in mm", move: "Move", moveHelp: "Moves the robot to this place",
    faultAt: (/** @type {string} */ code, /** @type {number} */ seconds) => `Error ${code} at ${seconds.toFixed(1)} s: `,
    faultPlace: (/** @type {FaultPlace} */ { file, line, function: of }) => `${file}:${line}${of ? `, in ${of}` : ""}`,
    robotAt: (/** @type {number | null} */ id, /** @type {number} */ seconds) => `Robot ${id} at ${seconds.toFixed(1)} s`,
    /** @type {(id: number | null, isContained: boolean, others: number) => string} */
    stoppedBy: (id, isContained, others) => `${isContained ? `A listener or handler of robot ${id} ended` : `Robot ${id} stopped`} by an error`
        + `${others > 0 ? `; so did ${others} more in the same tick` : ""}.`,
    memoryAtFault: (/** @type {number} */ seconds) => `Memory at the error, at ${seconds.toFixed(1)} s`,
    is: " is ", calledAt: "called at ", unknownPlace: "an unknown place", moreCalls: (/** @type {number} */ count) => `${count} more calls`,
    hideFault: "Hides the error",

    globals: "Globals", frame: "In", neighbors: "Neighbors", swarms: "Swarms", stigmergy: "Stigmergy",
    queues: "Messages", inbox: "to be read", outbox: "to be sent", none: "none",
    noMemory: "Its memory is in an emulator, or it has not joined yet.",
    /** @type {(neighbor: NeighborDescription) => string} */
    neighbor: ({ distance, azimuth }) => {
        const degrees = azimuth ? `, ${((azimuth * 180) / Math.PI).toFixed(0)}°` : "";
        return distance === null ? "heard, no place" : `${distance.toFixed(0)} mm away${degrees}`;
    },
    /** @type {(isMember: boolean) => string} */
    swarm: (isMember) => (isMember ? "a member" : "no member"),
    entry: (/** @type {number} */ owner, /** @type {number} */ clock) => `by robot ${owner}, clock ${clock}`,
    waiting: (/** @type {number} */ count, /** @type {number} */ capacity) => `${count} of ${capacity}`,
    message: (/** @type {MessageDescription<unknown>} */ one) => ("robot" in one ? `${one.kind} of ${one.robot}` : one.kind),
    table: (/** @type {number} */ count) => (count === 1 ? "1 entry" : `${count} entries`),
    leftOut: (/** @type {number} */ count) => `… ${count} more`,

    scriptText: "text of the script", diagnostics: "messages of the compiler", help: "help",
    controlsOfScripts: "controls of the scripts",
    keep: "keep numbers", keepHelp: "Globals that hold numbers keep them, where the new text has numbers, too",
    run: "Run", runHelp: "Starts the run from the beginning with the texts of this editor (Ctrl + Enter)", began: "The run has started from the beginning.",
    keepChanges: "keep my changes", keepChangesHelp: "Run: what you changed in the world happens again, at the same times",
    load: "Load now", loadHelp: "Robots get this text as their script now, while the run goes on (Shift + Ctrl + Enter)",
    loadOptions: "Load now:", ran: (/** @type {string} */ name) => `The robots run ${name}.`,
    runOn: "robots that run it", runOnAll: "on all that have it", runOnOne: (/** @type {number | null} */ id) => `on robot ${id}`,
    steps: "Line by line", stepBack: "Back", stepBackHelp: "To the statement before, also into the tick before (F7)",
    stepIn: "Next", stepInHelp: "To the next statement of the chosen robot, also in a function that is called. The world waits (F8)",
    stepOver: "Over", stepOverHelp: "To the next statement of this function, past the calls in between (F10)",
    stepOut: "Out", stepOutHelp: "To the next statement of the function that called this one (Shift + F8)",
    breakChosen: "pause for the chosen robot only", breakChosenHelp: "Breakpoints of other robots are passed. A click beside a line number, or F9, sets a breakpoint: the run pauses before that line",
    breakpoint: "The run pauses before this line", breakpointSet: (/** @type {number} */ line) => `Breakpoint at line ${line}`, breakpointGone: (/** @type {number} */ line) => `No breakpoint at line ${line}`,
    noStatement: (/** @type {number} */ line) => `No statement follows line ${line}, so it has no breakpoint.`,
    statementAt: (/** @type {number} */ id, /** @type {string} */ place, /** @type {string | null} */ of) => `Robot ${id}, before ${place}${of ? `, in ${of}` : ""}`,
    statementOf: (/** @type {number} */ number, /** @type {number} */ count, /** @type {number} */ seconds) => `(statement ${number} of ${count} of the tick after ${seconds.toFixed(1)} s)`,
    stepValues: "Values before it",
    write: "Save", writeHelp: "Writes the text to its file (Ctrl + S)", written: (/** @type {string} */ name) => `${name} is saved.`,
    download: "Download", downloadHelp: "Saves the text as a file (Ctrl + S)",
    changedOnDisk: (/** @type {string} */ name) => `${name} has another text on disk than this page has read.`,
    goneOnDisk: (/** @type {string} */ name) => `${name} cannot be read any more.`,
    overwrite: "Overwrite", overwriteHelp: "Writes your text to the file",
    loadOther: "Load", loadOtherHelp: "Shows the other text. Undo brings yours back (Ctrl + Z)",
    otherText: (/** @type {string} */ name) => `The session has another text of ${name}.`,
    unsavedTexts: "texts that were not saved",
    unsaved: (/** @type {string} */ name, /** @type {Date} */ time) => `${name}, typed ${time.toLocaleString("en-GB", { dateStyle: "medium", timeStyle: "short" })} and not saved`,
    unsavedOfOther: "The file has changed since.",
    restoreText: "Restore", restoreTextHelp: "Shows this text in the editor. Undo brings the other one back (Ctrl + Z)",
    discard: "Discard", discardHelp: "Deletes this text",
    unsavedMark: "Script •",
    link: "Link", linkHelp: "An address of this page that has the text",
    linked: "The address of this page has the text now.", linkedAndCopied: "The address of this page has the text now, and is in the clipboard.",
    offered: "The script of the address does not run here: mend it.",
    noStorage: (/** @type {string} */ reason) => `The browser does not keep texts that are not saved: ${reason}`,
    badAddress: "the address has a script that cannot be read",
    longAddress: (/** @type {string} */ path) => `the address has more text than it may have: ${path} is longer than 1 MiB, or all scripts than 4 MiB`,
    exportPage: "Export", exportHelp: "This page with scenario and scripts as one file, which runs without a network", exportedAs: "bittybuzz.html",
    explain: "Explain", explainHelp: "Explains the message", goThere: "To this place", fix: "Fix", fixHelp: "Changes the text as the message says",
    line: (/** @type {number} */ line) => `line ${line}`,

    seeking: (/** @type {number} */ seconds, /** @type {number} */ left) => `On the way to ${seconds.toFixed(1)} s: about ${left.toFixed(left < 10 ? 1 : 0)} s left.`,
    pausing: "The simulator finishes this step of the world.",
    lostLines: (/** @type {number} */ count) => `${count.toLocaleString("en")} earlier lines came faster than they can be shown.`,
    noLog: "Nothing was logged so far. A call such as log(\"count: \", n) in a script writes a line here.",
    noTests: "The scenario expects nothing. Each [[expect]] in its text becomes a light here.",
    measures: "Measures",
    /** @type {(value: number | null, isTime: boolean, isOver: boolean) => string} */
    measured: (value, isTime, isOver) => (value === null ? (isOver ? (isTime ? "not reached" : "no number") : "open") : isTime ? `${value.toFixed(1)} s` : numberText(value)),
    lightsOf: (/** @type {number} */ held, /** @type {number} */ count) => `${held} of ${count} lights green`,
    verdicts: { open: "open", held: "held", failed: "failed" },
    ofOlder: "of an older text",
    older: {
        edited: "These lights are of an older text: the text in the editor has not run yet. Press Run in Script.",
        loaded: "These lights are of an older text in part: a text was loaded during the run. Press Run in Script, which starts from the beginning.",
    },

    handIn: "Hand in", handInHelp: "Runs the texts of this run from the beginning, without your changes of the world, and saves a file with them and the verdict",
    trying: "The scripts are tried …", by: "Your name",
    /** @type {(result: ResultEvent) => string} */
    handedIn: ({ name, held, count, success }) => {
        const verdict = `${held} of ${count} held`;
        if (success) {
            return `${verdict}. ${name} is saved: hand it in.`;
        }
        return held === count
            ? `${verdict}, but a script had an error (see Log): the assignment is not solved yet. ${name} is saved all the same.`
            : `${verdict}: the assignment is not solved yet. ${name} is saved all the same.`;
    },
    grade: "Grade results", gradeHelp: "Runs files that were handed in (*.json) again in this scenario. They can also be dropped on the page. Nothing leaves this computer.",
    grading: "The results run …", tooLarge: (/** @type {string} */ name) => `${name} has more than 16 MB, so it is no result`, marksAs: "marks.csv", saveMarks: "Save as table", notRun: "does not run",
    marksHead: ["Result", "Held", "Notes"], heldOf: (/** @type {number} */ held, /** @type {number} */ count) => `${held} of ${count}`,
    sameAs: (/** @type {string} */ files) => `the same scripts as ${files}`, scriptError: "a script had an error",
    tryOut: "Try many times", sweepHelp: "The scenario from its start, beside this run: with the scripts as they ran last, and without your changes",
    vary: "Vary", varyNothing: "only chance", varyExample: "medium.ir.loss", values: "Values", valuesExample: "0, 0.1, 0.3",
    seeds: "Seeds for each", measure: "Show", start: "Start", stopTrials: "Stop", since: "true since, in s", expectation: "expectations",
    percentDone: (/** @type {number} */ percent) => `${percent} %`, saveTable: "Save as table", tableAs: "trials.csv",
    sweepLabel: "what was measured, for each value", chance: "chance",
    sweepHead: ["Value", "Trials", "Succeeded", "Median", "Half of them"], quartiles: (/** @type {number} */ low, /** @type {number} */ high) => `${numberText(low)} to ${numberText(high)}`,

    size: "Size", sizeOf: (/** @type {number} */ width, /** @type {number} */ height) => `${width} × ${height} mm`, robots: "Robots", seed: "Seed",
    runSeedHelp: "Starts the run from the beginning with this seed, which stands then in the text of the scenario",
    noWorld: "The scenario has no section [world]: write the seed into its text.",
    losses: "Messages that get lost", media: MEDIA,
    lossOf: (/** @type {string} */ name) => `share of the messages by ${name} that get lost`,
    percent: (/** @type {number} */ share) => `${Math.round(100 * share)} %`, ofModel: "by model",
    partition: "Partition", partLabel: "robots that hear only each other: ids, ranges or groups", partExample: "3, 5..8",
    drawLine: "Draw a line", drawLineHelp: "Drag a line through the world: robots on one side do not hear those on the other",
    cutOff: "Cut off", cutOffHelp: "These robots and all others do not hear each other",
    heal: "Heal", healHelp: "All hear each other again",
    fence: (/** @type {string} */ group) => `Fence of ${group}`, height: "Height",
    between: (/** @type {number | null} */ least, /** @type {number | null} */ most) => `${least ?? "no limit"} to ${most ?? "no limit"}${least === null && most === null ? "" : " mm"}`,
    surroundings: (/** @type {string} */ group) => `Surroundings of ${group}`, poses: "Wrong poses from outside",
    poseError: (/** @type {number} */ id, /** @type {number} */ x, /** @type {number} */ y, /** @type {number | null} */ other) =>
        `robot ${id}: ${[...(other === null ? [] : [`those of robot ${other}`]), ...(x === 0 && y === 0 ? [] : [`displaced by ${x}, ${y} mm`])].join(", ")}`,
    lamps: "Lamps", lamp: (/** @type {number} */ number) => `Lamp ${number}`, brightness: "bright",
    lampX: (/** @type {number} */ number) => `lamp ${number}: x in mm`, lampY: (/** @type {number} */ number) => `lamp ${number}: y in mm`,
    lampBrightness: (/** @type {number} */ number) => `lamp ${number}: brightness, 0 to 1023`,
    commands: "Your changes",
    undo: "Undo", undoHelp: "The run as it was before your last change", redo: "Redo", redoHelp: "The change again that was undone",
    deleteChange: (/** @type {string} */ text, /** @type {string} */ seconds) => `Delete ${text} at ${seconds} s`,
    deleteChangeHelp: "The run as if this change had never been made; later ones act again",
    eventAt: (/** @type {number} */ seconds) => `event of the scenario at ${seconds} s`,
    digest: "Digest", compute: "Compute",
    digestHelp: "A number that stands for the whole state: runs that went the same way have the same one",
    digestAt: (/** @type {string} */ digest, /** @type {number} */ seconds) => `${digest} at ${seconds.toFixed(1)} s`,
    savedAs: "session.toml",
};
