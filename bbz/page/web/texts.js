// All texts of the page.
export const texts = {
    controls: "run", play: "Play", pause: "Pause", playHelp: "Play or pause (space)",
    start: "To the beginning (Home)", back: "A tick back (,)", step: "A tick forward (.)",
    rate: "Speed", asFast: "as fast as it can", rateOf: (rate) => `${rate} ×`,
    save: "Save as scenario", saveHelp: "A scenario file that replays this session",
    clock: (seconds, end) => `${seconds.toFixed(1)} s of ${end.toFixed(1)} s`, time: "Time of the run",
    over: "The run is over.", cut: (reason) => `The recording ends early: ${reason}.`,
    away: "The session has ended. Start it again in the terminal.",
    broken: "The session has failed. Load the page again.",
    failed: (text) => `The run cannot go on: ${text}`,
    example: "Example",

    keys: "Keys", close: "Close",
    allKeys: [
        ["Space", "play or pause"], [",  .", "a tick back, a tick forward"], ["Home", "to the beginning"],
        ["Tab", "from one part of the page to the next"],
        ["n  p", "in the world: the next robot, the one before"], ["Esc", "in the world: no robot"],
        ["Shift + arrows", "in the world: moves the chosen robot by 10 mm"],
        ["Arrows  +  −  0", "in the world: move the view, zoom, show all"],
    ],

    canvas: "The world, seen from above. Keys: question mark",
    hint: "Click a robot to look into it. Drag robots, lamps or the ground; zoom with the wheel.",
    look: "how the world is shown", colour: "Colour by", byState: "state", messages: "Messages", trails: "Trails",
    picture: "Picture", pictureHelp: "Saves what is shown as a PNG file", pictureAs: "bittybuzz.png",
    drawing: "Drawing", drawingHelp: "Saves the world as an SVG file", drawingAs: "bittybuzz.svg",
    quantities: { plot: "of the scenario", robot: "each robot", swarm: "the swarm", global: "globals" },
    curveLabel: "the quantity over time",
    curve: (name, [least, low, median, high, most], count) => {
        const [a, b, c, d, e] = [least, low, median, high, most].map((value) => texts.number(value));
        return count === 1 ? `${name}: ${c}` : `${name}: median ${c}, half of the robots ${b} to ${d}, all ${a} to ${e}`;
    },
    curveOf: (id, value) => `; robot ${id}: ${texts.number(value)}`,
    number: (value) => (Number.isInteger(value) ? String(value) : value.toPrecision(4)),
    tabRobot: "Robot", tabLog: "Log", tabTests: "Tests", tabGround: "World",

    noRobot: "No robot is chosen. Click one.",
    robot: (id) => `Robot ${id}`,
    state: "State", states: ["running", "stopped", "failed", "stopped by an error"],
    group: "Group", script: "Script", place: "Place", memory: "Memory",
    placeOf: (x, y, z, degrees) => `(${x.toFixed(1)}, ${y.toFixed(1)}${z ? `, ${z.toFixed(1)}` : ""}) mm, ${degrees.toFixed(0)}°`,
    memoryOf: (used, all) => `${used} of ${all} slots`,
    fail: "Fail", failHelp: "No motor, no message, no step until it is restarted",
    stop: "Stop", stopHelp: "No motor, no message, no step until it resumes",
    resume: "Resume", resumeHelp: "A stopped robot goes on where it was",
    restart: "Restart", restartHelp: "Off and on: the script begins anew",
    block: "Cut off", blockHelp: "No message gets to it or from it",
    restore: "Reconnect", restoreHelp: "Its blocked links work again",
    x: "x in mm", y: "y in mm", move: "Move", moveHelp: "Moves the robot to this place",
    fault: (code, place) => (place ? `error ${code} in ${place.file}:${place.line}` : `error ${code}`),
    faultAt: (code, place, seconds) => `Error ${code} at ${seconds.toFixed(1)} s`
        + (place ? `: ${place.file}:${place.line}${place.function ? `, in ${place.function}` : ""}` : ""),

    globals: "Globals", frame: "In", neighbors: "Neighbours", swarms: "Swarms", stigmergy: "Stigmergy",
    queues: "Messages", inbox: "to be read", outbox: "to be sent", none: "none",
    noMemory: "Its memory is in an emulator, or it has not joined yet.",
    neighbor: ({ distance, azimuth }) => {
        const degrees = azimuth ? `, ${((azimuth * 180) / Math.PI).toFixed(0)}°` : "";
        return distance === null ? "heard, no place" : `${distance.toFixed(0)} mm away${degrees}`;
    },
    swarm: (isMember) => (isMember ? "a member" : "no member"),
    entry: (owner, clock) => `by robot ${owner}, clock ${clock}`,
    waiting: (count, capacity) => `${count} of ${capacity}`,
    message: (one) => `${one.kind}${one.robot === undefined ? "" : ` of ${one.robot}`}`,
    table: (count) => (count === 1 ? "1 entry" : `${count} entries`),
    leftOut: (count) => `… ${count} more`,

    noLog: "Nothing was logged so far.", noTests: "The scenario expects nothing.",
    verdicts: { open: "open", held: "held", failed: "failed" },

    size: "Size", sizeOf: (width, height) => `${width} × ${height} mm`, robots: "Robots", seed: "Seed",
    losses: "Messages that get lost", media: { ir: "Infrared", nrf24: "nRF24", p2p: "P2P", rab: "Range and bearing" },
    lossOf: (name) => `share of the messages by ${name} that get lost`,
    percent: (share) => `${Math.round(100 * share)} %`, ofModel: "by model",
    partition: "Partition", partLabel: "robots that hear only each other: ids, ranges or groups", partExample: "3, 5..8",
    drawLine: "Draw a line", drawLineHelp: "Drag a line through the world: robots on one side do not hear those on the other",
    cutOff: "Cut off", cutOffHelp: "These robots and all others do not hear each other",
    heal: "Heal", healHelp: "All hear each other again",
    lamps: "Lamps", lamp: (number) => `Lamp ${number}`, brightness: "bright",
    lampX: (number) => `lamp ${number}: x in mm`, lampY: (number) => `lamp ${number}: y in mm`,
    lampBrightness: (number) => `lamp ${number}: brightness, 0 to 1023`,
    commands: "Your changes", eventAt: (seconds) => `event of the scenario at ${seconds} s`,
    digest: "Digest", compute: "Compute",
    digestHelp: "A number that stands for the whole state: runs that went the same way have the same one",
    digestAt: (digest, seconds) => `${digest} at ${seconds.toFixed(1)} s`,
    savedAs: "session.toml",
};
