// The view of the world.

import { Camera } from "./camera.js";
import { inside, part, write } from "./element.js";
import { Fences } from "./fence.js";
import { dashes, fitRobots, follow, groupOf, reachOf } from "./focus.js";
import { Labels } from "./labels.js";
import { Obstacles } from "./obstacles.js";
import { drawPaint, groundColor } from "./paint.js";
import { Robots } from "./recording.js";
import { Scene, SHAPES } from "./scene.js";
import { texts } from "./texts.js";
import { Trails } from "./trails.js";

// Places of the chosen robot that are kept.
const TRAIL = 400;
// Milliseconds for which a message is seen while the run goes on.
const FLASH = 350;
// From low to high, as bright as the number is great (the colors of Cividis, for all eyes).
const PALETTE = [[0, 34, 78], [53, 69, 108], [102, 105, 112], [148, 142, 119], [200, 184, 102], [254, 232, 56]];
// The colors of the robots that are compared: variables of the style sheet.
export const COMPARED = ["--one", "--two", "--three", "--four", "--five", "--six"];
/** @type {Messages} */
const NO_MESSAGES = { heard: [], collided: [], lost: [] };
// Robots of this state, or of a lower one, have values and neighbors of now; those of a higher one have failed.
const STOPPED = 1;
// A robot of a large world is seen as a dot of two pixels. There is room for larger ones where robots are few.
const BODY_PIXELS_MIN = 1;
const BODY_PIXELS_MIN_OF_FEW = 4;
const FEW = 100;

/**
 * @import { AttitudeDescription, GlyphName, LightDescription, PoseErrorDescription, MessagesEvent } from "./events"
 * @import { Color, Dragged, Place, SpacePlace, World } from "./page"
 */

/**
 * Numbers of two robots for each message: the sender and the receiver.
 * @typedef {Pick<MessagesEvent, "heard" | "collided" | "lost">} Messages
 */

export class View {
    /** @param {HTMLCanvasElement} canvas */
    constructor(canvas) {
        this.canvas = canvas;
        this.scene = new Scene(canvas);
        this.camera = new Camera();
        this.obstacles = new Obstacles(this.scene);
        this.fences = new Fences(this.scene);
        // Robots can be above the ground.
        this.hasFliers = false;
        /** @type {number | null} */
        this.chosen = null;
        // Numbers of the robots whose curves are shown next to that of the chosen one, by place; `null`: a free place.
        /** @type {(number | null)[]} */
        this.compared = Array(COMPARED.length).fill(null);
        /** @type {Dragged | null} */
        this.dragged = null;
        /** @type {World | null} */
        this.world = null;
        this.robots = new Robots();
        /** @type {number[]} */
        this.radii = [];
        /** @type {GlyphName[]} */
        this.glyphs = [];
        // The attitudes of robots that tilt.
        /** @type {AttitudeDescription[]} */
        this.attitudes = [];
        /** @type {LightDescription[]} */
        this.lights = [];
        // Poses from outside that are wrong.
        /** @type {PoseErrorDescription[]} */
        this.poseErrors = [];
        // Numbers of the robots from which the chosen one has received messages.
        /** @type {number[]} */
        this.neighbors = [];
        // The place at which the chosen robot believes to be.
        /** @type {[number, number, number] | null} */
        this.estimate = null;
        /** @type {SpacePlace[]} */
        this.trail = [];
        this.hasTrails = false;
        this.trails = new Trails(this.scene);
        // Lines between two robots, and when they were drawn first; `null` while the run stands still.
        /** @type {Messages} */
        this.messages = NO_MESSAGES;
        /** @type {number | null} */
        this.flashed = null;
        // Receivers at which messages collided.
        /** @type {Set<number>} */
        this.deaf = new Set();
        const [lost, heard, links, stems, range] = Array.from({ length: 5 }, () => this.scene.makeLines());
        this.lines = { lost, heard, links, stems, range };
        this.labels = new Labels(part("labels"));
        // The chosen robot stays in the middle of the picture.
        this.isFollowing = false;
        // Messages whose lines are drawn, and the robots at their ends have not moved since; else `null`.
        /** @type {Messages | null} */
        this.drawn = null;
        // Ends of the line that the user draws through the world, in mm.
        /** @type {[Place, Place] | null} */
        this.cut = null;
        this.isCutting = false;
        // What is drawn over the world while it is built.
        /** @type {{ draw: () => void } | null} */
        this.overlay = null;
        // From 0 to 1 for each robot; `null`: by state.
        /** @type {(number | null)[] | null} */
        this.shares = null;
        this.isStale = true;
        this.isFitted = true;
        this.colors = readColors();
        matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
            this.colors = readColors();
            this.changed();
        });
        // The values that the parts next to the canvas show.
        /** @type {Map<string, string | number | null>} */
        this.shown = new Map();
        new ResizeObserver(() => this.resized()).observe(canvas);
        const frame = () => {
            if ((this.isStale || this.flashed !== null) && this.world) {
                this.isStale = false;
                this.draw();
            }
            requestAnimationFrame(frame);
        };
        requestAnimationFrame(frame);
    }

    /**
     * @param {World} world
     * @param {Robots} robots
     */
    begin(world, robots) {
        // A run that starts again is seen from the same place.
        const isSame = this.world?.scripts?.file === world.scripts?.file && this.world?.size.join() === world.size.join();
        this.world = world;
        this.lights = world.lights;
        this.poseErrors = world.pose_errors;
        this.robots = robots;
        this.radii = world.groups.flatMap((group) => Array(group.count).fill(group.radius));
        this.glyphs = world.groups.flatMap((group) => Array(group.count).fill(group.glyph));
        this.scene.setBodies(this.radii, this.glyphs);
        this.obstacles.set(world.obstacles, world.movables, world.size);
        this.fences.set(world.groups.flatMap(({ fence }) => fence ?? []), world.size);
        // A world that was edited may have fewer robots.
        const known = (/** @type {number | null} */ robot) => (robot !== null && robot < this.radii.length ? robot : null);
        this.chosen = known(this.chosen);
        this.compared = this.compared.map(known);
        this.setAttitudes([]);
        // Those with rotors, or in a recording those that have been above the ground.
        this.hasFliers = this.glyphs.includes("rotors");
        if (!isSame || this.isFitted) {
            this.fit();
        }
    }

    // Shows the whole world.
    fit() {
        if (!this.world) {
            return;
        }
        const top = this.robots.z.reduce((most, z) => Math.max(most, z / 10), this.obstacles.top);
        this.camera.fit(this.world.size, top, [this.scene.width, this.scene.height]);
        this.isFitted = true;
        this.changed();
    }

    // Shows all robots, as large as there is room.
    fitRobots() {
        fitRobots(this);
    }

    /** @param {boolean} isOn */
    follow(isOn) {
        this.isFollowing = isOn;
        if (isOn) {
            follow(this);
        }
    }

    resized() {
        this.scene.measure();
        if (this.isFitted) {
            this.fit();
        }
        this.changed();
    }

    changed() {
        this.isStale = true;
    }

    /** @param {number | null} robot */
    choose(robot) {
        this.chosen = robot;
        this.neighbors = [];
        this.estimate = null;
        this.trail = [];
        // Other messages are shown.
        this.drawn = null;
        if (this.isFollowing) {
            follow(this);
        }
        this.changed();
    }

    // Compares a robot, or no more. Returns false if there is no place for it.
    /** @param {number} robot */
    compare(robot) {
        const place = this.compared.indexOf(robot);
        const free = place >= 0 ? place : this.compared.indexOf(null);
        if (free >= 0) {
            this.compared[free] = place >= 0 ? null : robot;
        }
        this.changed();
        return free >= 0;
    }

    // The robots have moved; `isAnew` if the run was taken elsewhere.
    /** @param {boolean} isAnew */
    sampled(isAnew) {
        if (isAnew) {
            this.trail = [];
        }
        if (this.chosen !== null) {
            this.trail.push(this.spaceOf(this.chosen));
            this.trail.splice(0, this.trail.length - TRAIL);
        }
        if (isAnew || !(this.hasTrails || this.trails.isEmpty)) {
            this.trails.clear();
        }
        if (this.hasTrails) {
            this.trails.add(this.robots);
        }
        this.hasFliers ||= this.robots.z.some((z) => z > 0);
        if (this.isFollowing) {
            follow(this);
        }
        this.drawn = null;
        this.changed();
    }

    // From above, or in 3-D.
    /** @param {boolean} isTilted */
    tilt(isTilted) {
        this.camera.setTilt(isTilted);
        this.fit();
    }

    // Angles in radians.
    /**
     * @param {number} turn
     * @param {number} rise
     */
    turnBy(turn, rise) {
        if (this.camera.isTilted) {
            this.camera.turnBy(turn, rise);
            this.changed();
        }
    }

    /** @param {AttitudeDescription[]} attitudes */
    setAttitudes(attitudes) {
        this.attitudes = attitudes;
        this.scene.setAttitudes(attitudes);
        this.changed();
    }

    /** @param {Messages} messages */
    showMessages({ heard, collided, lost }, isPlaying = false) {
        this.messages = { heard, collided, lost };
        this.flashed = isPlaying ? performance.now() : null;
        this.changed();
    }

    /** @param {(number | null)[] | null} shares from 0 to 1 for each robot; `null`: by state */
    paint(shares) {
        this.shares = shares;
        this.scene.setShares(shares);
        this.changed();
    }

    draw() {
        const { scene, colors, world } = this;
        if (!world || scene.width === 0 || scene.height === 0) {
            return;
        }
        scene.begin(this.camera, colors.outside);
        this.drawGround(world);
        this.drawLinks();
        this.drawRobots();
        if (this.cut) {
            scene.addLine(...this.cut, 0, colors.chosen, 1.5);
        }
        this.overlay?.draw();
        scene.flush();
        this.labels.draw(this);
        this.showScale();
    }

    /** @param {World} world */
    drawGround(world) {
        const { scene, colors, dragged } = this;
        const [halfWidth, halfHeight] = world.size.map((side) => side / 2);
        const lights = this.lights.map((light, lamp) => ({ ...light, at: dragged?.lamp === lamp ? dragged.at : light.at }));
        scene.ground(halfWidth, halfHeight, groundColor(world, colors), () => {
            scene.grid(halfWidth, halfHeight, this.gridStep(), colors.grid);
            drawPaint(scene, world, colors);
            for (const { at, brightness } of lights) {
                // The law of the sensor: half of it after 350 mm.
                scene.add(...at, 700, 700, 0, SHAPES.light, fade(colors.light, 0.35 * Math.min(1, brightness / 1023)));
            }
        });
        for (const { at } of lights) {
            scene.add(...at, ...this.dot(9), 0, SHAPES.disc, colors.light);
            scene.add(...at, ...this.dot(14), 0, SHAPES.ring, fade(colors.light, 0.8));
        }
        this.obstacles.draw({ ...colors, ground: groundColor(world, colors) }, this.robots);
        this.fences.draw(colors.fence);
    }

    drawMessages() {
        const age = this.flashed === null ? 0 : (performance.now() - this.flashed) / FLASH;
        if (age >= 1) {
            this.flashed = null;
            this.messages = NO_MESSAGES;
        }
        if (this.drawn !== this.messages || this.dragged) {
            this.placeMessages();
            // Somebody who is dragged has another place in the next picture.
            this.drawn = this.dragged ? null : this.messages;
        }
        const { scene, lines, colors } = this;
        scene.drawLines(lines.lost, fade(colors.states[3], 0.5 * (1 - age)), 0.8);
        scene.drawLines(lines.heard, fade(colors.link, 0.5 * (1 - age)), 0.8);
        const color = fade(colors.states[3], 0.9 * (1 - age));
        for (const robot of this.deaf) {
            const size = this.radii[robot] * 1.5;
            this.ring(robot, size, color);
        }
    }

    placeMessages() {
        const { chosen } = this;
        // Of a chosen robot only its own messages are shown.
        const isThere = (/** @type {[number, number]} */ [from, to]) => Math.max(from, to) < this.robots.count
            && (chosen === null || from === chosen || to === chosen);
        for (const kind of /** @type {("lost" | "heard")[]} */ (["lost", "heard"])) {
            const pairs = this.messages[kind].filter(isThere);
            this.setLines(kind, pairs.map(([from, to]) => [this.spaceOf(from), this.spaceOf(to)]));
        }
        // Robots at which messages collide receive none of them.
        this.deaf = new Set(this.messages.collided.filter(isThere).map(([, to]) => to));
    }

    // Lines between pairs of places in mm.
    /**
     * @param {keyof View["lines"]} kind
     * @param {SpacePlace[][]} pairs
     */
    setLines(kind, pairs) {
        this.scene.setLines(this.lines[kind], Float32Array.from(pairs.flat(2), (mm) => 10 * mm));
    }

    drawLinks() {
        this.trails.draw(fade(this.colors.states[0], 0.9));
        this.drawMessages();
        this.drawPoseErrors();
        const { scene, colors, trail, lines } = this;
        // Older parts of the trail are paler.
        for (let index = 1; index < trail.length; index++) {
            const [from, to] = [trail[index - 1], trail[index]];
            scene.addLine(from, to, 0, fade(colors.chosen, (0.7 * index) / trail.length), 1, to[2]);
        }
        // A robot that has failed receives nothing more.
        if (this.chosen !== null && this.robots.state[this.chosen] <= STOPPED) {
            const from = this.spaceOf(this.chosen);
            this.setLines("links", this.neighbors.map((robot) => [from, this.spaceOf(robot)]));
            scene.drawLines(lines.links, fade(colors.link, 0.75), 1);
            const group = this.world && groupOf(this.world, this.chosen);
            const reach = group ? reachOf(group) : null;
            this.setLines("range", reach === null ? [] : dashes(from, reach));
            scene.drawLines(lines.range, fade(colors.link, 0.8), 0.8);
        }
        if (this.camera.isTilted) {
            const fliers = [...this.robots.z.keys()].filter((robot) => this.robots.isThere[robot] && this.robots.z[robot] > 0);
            this.setLines("stems", fliers.map((robot) => [[...this.placeOf(robot), 0], this.spaceOf(robot)]));
            scene.drawLines(lines.stems, fade(colors.states[0], 0.6), 0.5);
        }
    }

    // A line and a ring show the place that a robot gets from outside in place of its own.
    drawPoseErrors() {
        const color = fade(this.colors.states[3], 0.9);
        for (const { robot, displaced, seen_as: other } of this.poseErrors) {
            if (this.robots.isThere[robot]) {
                const [x, y, z] = this.spaceOf(other ?? robot);
                const [toX, toY] = [x + displaced[0], y + displaced[1]];
                this.scene.addLine(this.placeOf(robot), [toX, toY], 0, color, 1, z);
                const size = Math.max(this.radii[robot], 4 / this.camera.scale);
                this.scene.add(toX, toY, size, size, 0, SHAPES.ring, color, z);
            }
        }
    }

    drawRobots() {
        const { scene, colors, robots, dragged } = this;
        scene.drawRobots(robots, { states: colors.states, palette: PALETTE, edge: this.edge, limb: colors.limb, pixelsMin: robots.count > FEW ? BODY_PIXELS_MIN : BODY_PIXELS_MIN_OF_FEW, dragged, shadow: fade(colors.edge, 0.3) });
        this.compared.forEach((robot, place) => {
            if (robot !== null && robots.isThere[robot]) {
                const size = Math.max(this.radii[robot], 4 / this.camera.scale) * 1.35;
                this.ring(robot, size, colors.compared[place]);
            }
        });
        if (this.chosen !== null && robots.isThere[this.chosen]) {
            const size = Math.max(this.radii[this.chosen], 4 / this.camera.scale) * 1.15;
            this.ring(this.chosen, size, colors.chosen);
            this.drawEstimate(this.chosen, size, fade(colors.chosen, 0.6));
        }
    }

    // A line and a ring show where the robot believes to be.
    /**
     * @param {number} robot
     * @param {number} size
     * @param {Color} color
     */
    drawEstimate(robot, size, color) {
        if (this.estimate !== null) {
            const [x, y, z] = this.estimate;
            this.scene.addLine(this.placeOf(robot), [x, y], 0, color, 1, z);
            this.scene.add(x, y, size * 0.6, size * 0.6, 0, SHAPES.ring, color, z);
        }
    }

    /**
     * @param {number} robot
     * @param {number} size
     * @param {Color} color
     */
    ring(robot, size, color) {
        const [x, y, z] = this.spaceOf(robot);
        this.scene.add(x, y, size, size, 0, SHAPES.ring, color, z);
    }

    // The least values have a color that is not seen on a dark ground.
    get edge() {
        return this.shares ? this.colors.limb : this.colors.edge;
    }

    // By its share of the shown quantity, or its state.
    /** @param {number} robot */
    colorOf(robot) {
        const share = this.shares?.[robot];
        return typeof share === "number" && this.robots.state[robot] <= STOPPED ? mix(share) : this.colors.states[this.robots.state[robot]];
    }

    /**
     * @param {number} mm
     * @returns {Place}
     */
    dot(mm) {
        const size = Math.max(mm, 4 / this.camera.scale);
        return [size, size];
    }

    /**
     * @param {number} robot
     * @returns {Place}
     */
    placeOf(robot) {
        if (this.dragged?.robot === robot) {
            return this.dragged.at;
        }
        return [this.robots.x[robot] / 10, this.robots.y[robot] / 10];
    }

    // With its height.
    /**
     * @param {number} robot
     * @returns {SpacePlace}
     */
    spaceOf(robot) {
        return [...this.placeOf(robot), this.robots.z[robot] / 10];
    }

    // 1, 2 or 5 times a power of ten, in mm: at least 40 pixels.
    gridStep() {
        const least = 40 / this.camera.scale;
        const power = 10 ** Math.floor(Math.log10(least));
        return [1, 2, 5].map((times) => times * power).find((step) => step >= least) ?? 10 * power;
    }

    showScale() {
        const step = this.gridStep();
        this.show("bar", step * this.camera.scale, (bar, width) => {
            bar.style.width = `${width}px`;
        });
        this.show("bar-text", `${step} mm`, (place, text) => {
            write(place, text);
        });
        this.showWind();
        let shown = "";
        if (this.chosen !== null) {
            const [right, up] = this.camera.project(...this.spaceOf(this.chosen));
            const away = this.radii[this.chosen] * this.camera.scale + 6;
            const left = this.scene.width / 2 + right + away;
            const top = this.scene.height / 2 - up - away;
            shown = [this.robots.ids[this.chosen], left, top].join(" ");
        }
        this.show("name", shown, (name) => {
            name.hidden = shown === "";
            const [id = "", left = 0, top = 0] = shown.split(" ");
            write(name, id);
            name.style.left = `${left}px`;
            name.style.top = `${top}px`;
        });
    }

    // The arrow points to where the wind blows on the screen.
    showWind() {
        const [x = 0, y = 0] = this.world?.groups.find(({ wind }) => wind)?.wind ?? [];
        const [right, up] = this.camera.project(x, y, 0).map((end, axis) => end - this.camera.project(0, 0, 0)[axis]);
        const degrees = Math.round((Math.atan2(up, right) * 180) / Math.PI);
        this.show("wind", x === 0 && y === 0 ? "" : `${Math.round(Math.hypot(x, y))} ${degrees}`, (wind, shown) => {
            wind.hidden = shown === "";
            const [speed = "", turn = "0"] = shown.split(" ");
            inside(wind, "i").style.transform = `rotate(${-Number(turn)}deg)`;
            write(inside(wind, "span"), texts.wind(speed));
        });
    }

    // Sets a part of the page only when something else is to be shown there, because the browser then computes its style again.
    /**
     * @template {string | number} Value
     * @param {string} id
     * @param {Value} value
     * @param {(element: HTMLElement, value: Value) => void} set
     */
    show(id, value, set) {
        if (this.shown.get(id) !== value) {
            this.shown.set(id, value);
            set(part(id), value);
        }
    }

    // From a place on the screen to mm, at a height.
    /** @param {{ clientX: number, clientY: number }} place */
    toWorld({ clientX, clientY }, z = 0) {
        const box = this.canvas.getBoundingClientRect();
        return this.camera.placeAt(clientX - box.left - box.width / 2, box.top + box.height / 2 - clientY, z);
    }

    // The robot that is seen nearest to a place on the ground, within some pixels.
    /** @param {Place} place */
    robotAt([x, y]) {
        const { camera } = this;
        const [right, up] = camera.project(x, y);
        /** @type {number | null} */
        let found = null;
        let least = Infinity;
        for (let robot = 0; robot < this.robots.count; robot++) {
            const [itsRight, itsUp] = camera.project(...this.spaceOf(robot));
            const away = Math.hypot(itsRight - right, itsUp - up);
            const reach = this.radii[robot] * camera.scale + 6;
            if (this.robots.isThere[robot] && away < reach && away < least) {
                [found, least] = [robot, away];
            }
        }
        return found;
    }

    /** @param {Place} place */
    lampAt([x, y]) {
        const found = this.lights.findIndex(({ at }) => Math.hypot(at[0] - x, at[1] - y) < Math.max(14, 12 / this.camera.scale));
        return found < 0 ? null : found;
    }

    // The next drag draws a line.
    beginCut() {
        this.isCutting = true;
        this.canvas.style.cursor = "crosshair";
        this.canvas.focus();
    }

    /**
     * @param {Place} from
     * @param {Place} to
     */
    idsLeftOf([x, y], [toX, toY]) {
        const { robots } = this;
        return robots.ids.filter((_, robot) => {
            const [atX, atY] = this.placeOf(robot);
            return robots.isThere[robot] && (toX - x) * (atY - y) - (toY - y) * (atX - x) > 0;
        });
    }

    /**
     * @param {number} right
     * @param {number} down
     */
    pan(right, down) {
        this.camera.pan(right, down);
        this.isFitted = false;
        this.changed();
    }

    // Shows a place on the ground at a point of the screen.
    /**
     * @param {Place} place
     * @param {{ clientX: number, clientY: number }} point
     */
    hold([x, y], point) {
        const [shownX, shownY] = this.toWorld(point);
        this.camera.x += x - shownX;
        this.camera.y += y - shownY;
        this.isFitted = false;
        this.changed();
    }

    // A place stays where it is on the screen.
    /**
     * @param {number} factor
     * @param {Place} [place]
     */
    zoom(factor, place) {
        this.camera.zoom(factor, place);
        this.isFitted = false;
        this.changed();
    }
}

// The colors of the style sheet.
function readColors() {
    const style = getComputedStyle(document.documentElement);
    /** @type {(name: string) => Color} */
    const color = (name) => {
        const hex = style.getPropertyValue(name).trim().slice(1);
        return [0, 2, 4].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255).concat(1);
    };
    return {
        text: style.getPropertyValue("--text").trim(), halo: style.getPropertyValue("--ground").trim(),
        outside: color("--outside"), ground: color("--ground"), black: color("--black"), white: color("--white"), grid: color("--grid"), edge: color("--edge"), limb: color("--limb"),
        obstacle: color("--obstacle"), fence: color("--fence"), movable: color("--movable"), light: color("--light"), chosen: color("--mark"), link: color("--accent"),
        compared: COMPARED.map(color),
        states: ["--running", "--stopped", "--failed", "--faulted"].map(color),
    };
}

/**
 * @param {Color} color
 * @param {number} alpha
 */
function fade(color, alpha) {
    return [...color.slice(0, 3), alpha];
}

// The color of a share from 0 to 1.
/** @param {number} share */
function mix(share) {
    const at = share * (PALETTE.length - 1);
    const low = Math.min(Math.floor(at), PALETTE.length - 2);
    return PALETTE[low].map((part, index) => (part + (PALETTE[low + 1][index] - part) * (at - low)) / 255).concat(1);
}
