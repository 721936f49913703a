// The world in WebGL 2.
//
// Bodies and glows are drawn from the samples as they are: their numbers go to the graphics card once for each sample, and all
// robots take one call. Lines between robots and trails go there when they change. Only shapes, of which there are few, are placed
// for each picture. The ground is cleared, not painted.
//
// A processor that computes WebGL (SwiftShader) takes as long for an instance as for a call, and for a robot as a point a quarter
// of the time of a square. So robots are points, and lines and shapes are squares of four corners, without instances. Each program
// fades the edges of what it draws, so the canvas needs only one sample for a pixel.

import { GLOW, GLYPHS, robotFragment, robotVertex } from "./bodies.js";
import {
    FADE_FRAGMENT, LAYER_FRAGMENT, LAYER_VERTEX, LINE_FRAGMENT, LINE_VERTEX, Program, SHAPE_FRAGMENT, SHAPE_VERTEX,
} from "./programs.js";

export const SHAPES = { disc: 0, box: 1, light: 2, ring: 3 };

// Numbers of a shape: middle, half size, angle, kind, color, height.
const WIDTH = 11;
// Pixels of the radius of a glow that the body does not hide.
const GLOW_PIXELS_MIN = 1.5;

/**
 * @import { AttitudeDescription, GlyphName } from "./events"
 * @import { Camera } from "./camera.js"
 * @import { Color, Dragged, Layer, Lines, Place } from "./page"
 * @import { Robots } from "./recording.js"
 */

export class Scene {
    /** @param {HTMLCanvasElement} canvas */
    constructor(canvas) {
        const gl = canvas.getContext("webgl2", { alpha: false, antialias: false, depth: false });
        if (!gl) {
            throw new Error("WebGL 2");
        }
        this.gl = gl;
        this.canvas = canvas;
        this.width = 0;
        this.height = 0;
        // The camera of the picture, the pixels for one mm, and the place in the middle.
        /** @type {Pick<Camera, "x" | "y" | "scale" | "axes" | "isTilted" | "depth" | "height" | "farness">} */
        this.camera = { x: 0, y: 0, scale: 1, axes: [1, 0, 0, 1, 0, 0], isTilted: false, depth: 1, height: 0, farness: () => 0 };
        this.scale = 1;
        this.middle = [0, 0];
        // The greatest radius in mm, and the number of robots that have one.
        this.largest = 0;
        this.sized = 0;
        const corners = gl.createBuffer();
        gl.bindBuffer(gl.ARRAY_BUFFER, corners);
        gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]), gl.STATIC_DRAW);
        this.shapes = new Program(gl, SHAPE_VERTEX, SHAPE_FRAGMENT);
        this.segments = new Program(gl, LINE_VERTEX, LINE_FRAGMENT);
        this.fades = new Program(gl, LAYER_VERTEX, FADE_FRAGMENT);
        this.layers = new Program(gl, LAYER_VERTEX, LAYER_FRAGMENT);
        /** @type {(isPoint: boolean, isGlow: boolean) => Program} */
        const robot = (isPoint, isGlow) => {
            const program = new Program(gl, robotVertex(isPoint, isGlow), robotFragment(isPoint, isGlow), isPoint ? 0 : 1);
            program.read(corners, [[0, 2, 0]], gl.FLOAT);
            gl.vertexAttribDivisor(0, 0);
            return program;
        };
        // Programs for squares, and for points.
        this.bodies = [robot(false, false), robot(true, false)];
        this.glows = [robot(false, true), robot(true, true)];
        this.programs = [this.shapes, this.segments, ...this.bodies, ...this.glows];
        /** @type {number} */
        this.pointSizeMax = gl.getParameter(gl.ALIASED_POINT_SIZE_RANGE)[1];
        this.quads = { buffer: gl.createBuffer(), count: 0 };
        this.count = 0;
        this.data = new Float32Array(4 * WIDTH * 64);
        this.placed = gl.createBuffer();
        this.shapes.read(this.placed, [[1, 2, 0], [2, 2, 8], [3, 2, 16], [4, 4, 24], [5, 1, 40]], gl.FLOAT, WIDTH * 4);
        // The part of a sample that the graphics card has.
        this.sample = { buffer: gl.createBuffer(), version: -1, count: 0, hasLeds: false };
        this.radii = gl.createBuffer();
        this.glyphs = gl.createBuffer();
        // Three numbers for each robot, while there are robots that tilt.
        this.leans = { buffer: gl.createBuffer(), count: 0 };
        /** @type {{ buffer: WebGLBuffer, count: number } | null} */
        this.shares = null;
        // Robots from the farthest to the nearest, in 3-D.
        this.order = gl.createBuffer();
        gl.enable(gl.BLEND);
        gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
        this.measure();
    }

    // The canvas has another size.
    measure() {
        this.width = this.canvas.clientWidth;
        this.height = this.canvas.clientHeight;
    }

    // Begins a picture, as a camera sees it.
    /**
     * @param {Camera} camera
     * @param {Color} background
     */
    begin(camera, background) {
        const { gl, canvas } = this;
        const ratio = globalThis.devicePixelRatio || 1;
        const [width, height] = [this.width, this.height].map((length) => Math.round(length * ratio));
        if (canvas.width !== width || canvas.height !== height) {
            canvas.width = width;
            canvas.height = height;
        }
        this.count = 0;
        this.camera = camera;
        this.scale = camera.scale * ratio;
        this.middle = [camera.x, camera.y];
        gl.viewport(0, 0, width, height);
        this.setClearColor(background);
        gl.clear(gl.COLOR_BUFFER_BIT);
        for (const program of this.programs) {
            program.use();
            gl.uniform4f(program.at("view"), camera.x, camera.y, (this.scale * 2) / width, (this.scale * 2) / height);
            gl.uniform2f(program.at("canvas"), width / 2, height / 2);
            gl.uniformMatrix3x2fv(program.at("axes"), false, camera.axes);
        }
    }

    /** @param {Color} color */
    setClearColor([red, green, blue, alpha]) {
        this.gl.clearColor(red, green, blue, alpha);
    }

    // Clears a rectangle around the middle of the world; `inside()` draws what is only seen there. In 3-D it is painted.
    /**
     * @param {number} halfWidth
     * @param {number} halfHeight
     * @param {Color} color
     * @param {() => void} inside
     */
    ground(halfWidth, halfHeight, color, inside) {
        const { gl } = this;
        if (this.camera.isTilted) {
            this.add(0, 0, halfWidth, halfHeight, 0, SHAPES.box, color);
            inside();
            return this.flush();
        }
        const [left, bottom] = this.pixelOf(-halfWidth, -halfHeight).map(Math.round);
        const [right, top] = this.pixelOf(halfWidth, halfHeight).map(Math.round);
        this.flush();
        gl.enable(gl.SCISSOR_TEST);
        gl.scissor(left, bottom, right - left, top - bottom);
        this.setClearColor(color);
        gl.clear(gl.COLOR_BUFFER_BIT);
        inside();
        this.flush();
        gl.disable(gl.SCISSOR_TEST);
    }

    // Lines at multiples of `step` mm, each a pixel wide.
    /**
     * @param {number} halfWidth
     * @param {number} halfHeight
     * @param {number} step
     * @param {Color} color
     */
    grid(halfWidth, halfHeight, step, color) {
        const { isTilted, depth } = this.camera;
        const half = 0.5 / this.scale / depth;
        const sides = [this.canvas.width, this.canvas.height];
        const reach = sides.map((pixels) => (isTilted ? Math.hypot(...sides) / depth : pixels) / 2 / this.scale);
        [halfWidth, halfHeight].forEach((most, axis) => {
            const first = Math.ceil(Math.max(-most, this.middle[axis] - reach[axis]) / step);
            const last = Math.floor(Math.min(most, this.middle[axis] + reach[axis]) / step);
            for (let line = first; line <= last; line++) {
                // The middle of a pixel, so that the line is sharp.
                const pixel = Math.floor(this.pixelOf(line * step, line * step)[axis]) + 0.5;
                const at = isTilted ? line * step : (pixel - sides[axis] / 2) / this.scale + this.middle[axis];
                axis === 0 ? this.add(at, 0, half, halfHeight, 0, SHAPES.box, color) : this.add(0, at, halfWidth, half, 0, SHAPES.box, color);
            }
        });
    }

    // A place in pixels from the lower left corner.
    /**
     * @param {number} x
     * @param {number} y
     */
    pixelOf(x, y) {
        return [(x - this.middle[0]) * this.scale + this.canvas.width / 2, (y - this.middle[1]) * this.scale + this.canvas.height / 2];
    }

    // Adds a shape that lies on the ground, or above it. Middle, half size and height in mm, angle in radians, color as four numbers
    // from 0 to 1.
    /**
     * @param {number} x
     * @param {number} y
     * @param {number} halfWidth
     * @param {number} halfHeight
     * @param {number} angle
     * @param {number} shape
     * @param {Color} color
     */
    add(x, y, halfWidth, halfHeight, angle, shape, color, height = 0) {
        const at = this.count * 4 * WIDTH;
        if (at + 4 * WIDTH > this.data.length) {
            const larger = new Float32Array(this.data.length * 2);
            larger.set(this.data);
            this.data = larger;
        }
        const { data } = this;
        data[at] = x;
        data[at + 1] = y;
        data[at + 2] = halfWidth;
        data[at + 3] = halfHeight;
        data[at + 4] = angle;
        data[at + 5] = shape;
        data[at + 6] = color[0];
        data[at + 7] = color[1];
        data[at + 8] = color[2];
        data[at + 9] = color[3];
        data[at + 10] = height;
        for (let corner = 1; corner < 4; corner++) {
            data.copyWithin(at + corner * WIDTH, at, at + WIDTH);
        }
        this.count += 1;
    }

    // Adds a line between two places in mm, at least `thick` mm to each side, or `pixels`.
    /**
     * @param {number[]} from
     * @param {number[]} to
     * @param {number} thick
     * @param {Color} color
     */
    addLine([x, y], [toX, toY], thick, color, pixels = 1, height = 0) {
        const half = Math.max(thick, pixels / this.camera.scale);
        const length = Math.hypot(toX - x, toY - y);
        const angle = Math.atan2(toY - y, toX - x);
        this.add((x + toX) / 2, (y + toY) / 2, length / 2, half, angle, SHAPES.box, color, height);
    }

    // Draws the shapes so far, below all that follows.
    flush() {
        if (this.count > 0) {
            this.fill(this.placed, this.data.subarray(0, this.count * 4 * WIDTH));
            this.drawQuads(this.shapes, this.count);
            this.count = 0;
        }
    }

    // Makes lines that stay the same for several pictures. They have to be set.
    /** @returns {Lines} */
    makeLines() {
        return { buffer: this.gl.createBuffer(), count: 0 };
    }

    /** @param {Lines} lines */
    dropLines(lines) {
        this.gl.deleteBuffer(lines.buffer);
    }

    // Six numbers for each line: x, y and z of its ends in tenths of mm.
    /**
     * @param {Lines} lines
     * @param {Float32Array} ends
     */
    setLines(lines, ends) {
        const count = ends.length / 6;
        const corners = new Float32Array(24 * count);
        for (let line = 0; line < count; line++) {
            for (let corner = 0; corner < 4; corner++) {
                for (let part = 0; part < 6; part++) {
                    corners[24 * line + 6 * corner + part] = ends[6 * line + part];
                }
            }
        }
        this.fill(lines.buffer, corners);
        lines.count = count;
    }

    // `halfWidth` in pixels of the page.
    /**
     * @param {Lines} lines
     * @param {Color} color
     * @param {number} halfWidth
     */
    drawLines(lines, color, halfWidth) {
        if (lines.count > 0) {
            const { gl, segments } = this;
            this.flush();
            segments.use();
            segments.read(lines.buffer, [[1, 3, 0], [2, 3, 12]], gl.FLOAT, 24);
            gl.uniform4fv(segments.at("paint"), color);
            gl.uniform1f(segments.at("halfWidth"), halfWidth * (globalThis.devicePixelRatio || 1));
            this.drawQuads(segments, lines.count);
        }
    }

    // Makes a layer: lines that stay from one picture to the next, as a share from 0 to 1 for each pixel.
    /** @returns {Layer} */
    makeLayer() {
        const { gl } = this;
        return { texture: gl.createTexture(), frame: gl.createFramebuffer(), seen: "" };
    }

    // Returns true if a layer was painted for this picture's camera and canvas; else it is cleared, and all has to be painted again.
    /** @param {Layer} layer */
    readyLayer(layer) {
        const { gl, camera } = this;
        const { width, height } = this.canvas;
        const seen = [camera.x, camera.y, this.scale, ...camera.axes, width, height].join(" ");
        if (layer.seen === seen) {
            return true;
        }
        gl.bindTexture(gl.TEXTURE_2D, layer.texture);
        gl.texImage2D(gl.TEXTURE_2D, 0, gl.R8, width, height, 0, gl.RED, gl.UNSIGNED_BYTE, null);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
        gl.bindFramebuffer(gl.FRAMEBUFFER, layer.frame);
        gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, layer.texture, 0);
        gl.bindFramebuffer(gl.FRAMEBUFFER, null);
        layer.seen = seen;
        return false;
    }

    // The next picture paints a layer again.
    /** @param {Layer} layer */
    clearLayer(layer) {
        layer.seen = "";
    }

    // Takes a share away from all pixels of a layer, and draws into it: `paint()` draws shares as shades of grey.
    /**
     * @param {Layer} layer
     * @param {number} share
     * @param {() => void} paint
     */
    paintLayer(layer, share, paint) {
        const { gl } = this;
        this.flush();
        gl.bindTexture(gl.TEXTURE_2D, null);
        gl.bindFramebuffer(gl.FRAMEBUFFER, layer.frame);
        this.fade(share);
        paint();
        gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    }

    // Takes a share away from all pixels.
    /** @param {number} share */
    fade(share) {
        const { gl, fades } = this;
        gl.blendEquation(gl.FUNC_REVERSE_SUBTRACT);
        gl.blendFunc(gl.ONE, gl.ONE);
        fades.use();
        gl.uniform4f(fades.at("paint"), share, share, share, share);
        gl.drawArrays(gl.TRIANGLES, 0, 3);
        gl.blendEquation(gl.FUNC_ADD);
        gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    }

    // Draws a layer in one color.
    /**
     * @param {Layer} layer
     * @param {Color} color
     */
    drawLayer(layer, color) {
        const { gl, layers } = this;
        gl.bindTexture(gl.TEXTURE_2D, layer.texture);
        layers.use();
        gl.uniform4fv(layers.at("paint"), color);
        gl.drawArrays(gl.TRIANGLES, 0, 3);
    }

    // Squares of four corners each, in the order of their numbers.
    /**
     * @param {Program} program
     * @param {number} count
     */
    drawQuads(program, count) {
        const { gl, quads } = this;
        program.use();
        gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, quads.buffer);
        if (quads.count < count) {
            quads.count = 2 * count;
            const corners = [0, 1, 2, 2, 1, 3];
            gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, Uint32Array.from({ length: 6 * quads.count }, (_, index) => 4 * Math.floor(index / 6) + corners[index % 6]), gl.STATIC_DRAW);
        }
        gl.drawElements(gl.TRIANGLES, 6 * count, gl.UNSIGNED_INT, 0);
    }

    // The radii of all robots in mm, and the names of their glyphs.
    /**
     * @param {number[]} radii
     * @param {GlyphName[]} glyphs
     */
    setBodies(radii, glyphs) {
        this.fill(this.radii, Float32Array.from(radii));
        this.fill(this.glyphs, Float32Array.from(glyphs, (glyph) => GLYPHS[glyph]));
        this.leans.count = 0;
        this.largest = radii.reduce((most, radius) => Math.max(most, radius), 0);
        this.sized = radii.length;
    }

    // The attitudes of robots; all others are level.
    /** @param {AttitudeDescription[]} attitudes */
    setAttitudes(attitudes) {
        this.leans.count = attitudes.length === 0 ? 0 : this.sized;
        if (this.leans.count > 0) {
            const leans = new Float32Array(3 * this.sized).map((_, index) => (index % 3 === 2 ? -1 : 0));
            for (const { robot, roll, pitch, thrust } of attitudes) {
                leans.set([(roll * Math.PI) / 180, (pitch * Math.PI) / 180, thrust / 100], 3 * robot);
            }
            this.fill(this.leans.buffer, leans);
        }
    }

    // From 0 to 1 for each robot, or something else for robots without one; `null`: by state.
    /** @param {(number | null)[] | null} shares */
    setShares(shares) {
        if (shares === null) {
            this.shares = null;
        } else {
            this.shares = { buffer: this.shares?.buffer ?? this.gl.createBuffer(), count: shares.length };
            this.fill(this.shares.buffer, Float32Array.from(shares, (share) => (typeof share === "number" ? share : -1)));
        }
    }

    // All robots of a sample.
    /**
     * @param {Robots} robots
     * @param {object} style
     * @param {Color[]} style.states
     * @param {number[][]} style.palette from 0 to 255
     * @param {Color} style.edge
     * @param {Color} style.limb of wheels, legs and arms
     * @param {number} style.pixelsMin
     * @param {Dragged | null} style.dragged
     * @param {Color} style.shadow
     */
    drawRobots(robots, { states, palette, edge, limb, pixelsMin, dragged, shadow }) {
        const { gl } = this;
        this.flush();
        this.take(robots);
        const ratio = globalThis.devicePixelRatio || 1;
        const count = Math.min(robots.count, this.sized);
        const hasShares = this.shares !== null && this.shares.count >= count;
        const hasLeds = this.sample.hasLeds && this.shares === null;
        // A body that stands up in 3-D is higher than its radius.
        const radius = this.largest * this.scale * (1 + this.camera.height);
        /** @type {[Program[], number, Color][]} */
        const layers = [[this.bodies, radius, [0, 0, 0, 0]]];
        if (radius * GLOW >= GLOW_PIXELS_MIN && hasLeds) {
            layers.unshift([this.glows, radius * GLOW, [0, 0, 0, 0]]);
        }
        const { isTilted, depth, height } = this.camera;
        if (isTilted) {
            layers.unshift([this.bodies, radius, shadow]);
            this.sort(robots, count);
        }
        for (const [programs, pixels, tint] of layers) {
            // Half a pixel of the edge is beyond the radius.
            const isPoint = 2 * pixels + 2 < this.pointSizeMax;
            const program = programs[Number(isPoint)];
            program.use();
            this.readRobots(program, robots, hasShares);
            gl.uniform2f(program.at("scale"), this.scale, pixelsMin * ratio);
            const [x, y] = dragged?.at ?? [0, 0];
            gl.uniform3f(program.at("dragged"), dragged?.robot ?? -1, x, y);
            gl.uniform3fv(program.at("states"), states.flatMap((color) => color.slice(0, 3)));
            gl.uniform3fv(program.at("palette"), palette.flat().map((part) => part / 255));
            gl.uniform3fv(program.at("edge"), edge.slice(0, 3));
            gl.uniform3fv(program.at("limb"), limb.slice(0, 3));
            gl.uniform1i(program.at("hasLeds"), Number(hasLeds));
            gl.uniform1i(program.at("isShadow"), Number(tint[3] > 0));
            gl.uniform4fv(program.at("shadow"), tint);
            gl.uniform2f(program.at("depth"), depth, height);
            if (isPoint && isTilted) {
                gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.order);
                gl.drawElements(gl.POINTS, count, gl.UNSIGNED_INT, 0);
            } else if (isPoint) {
                gl.drawArrays(gl.POINTS, 0, count);
            } else {
                gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, count);
            }
        }
    }

    // Puts the robots in order: what is nearer hides what is behind it.
    /**
     * @param {Robots} robots
     * @param {number} count
     */
    sort({ x, y, z }, count) {
        const { gl, camera } = this;
        const farness = Float32Array.from({ length: count }, (_, robot) => camera.farness(x[robot], y[robot], z[robot]));
        const order = Uint32Array.from(farness.keys()).sort((one, other) => farness[other] - farness[one]);
        gl.bindVertexArray(null);
        gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.order);
        gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, order, gl.DYNAMIC_DRAW);
    }

    // Gives the graphics card a sample that it does not have yet.
    /** @param {Robots} robots */
    take(robots) {
        const { gl, sample } = this;
        if (sample.version === robots.version) {
            return;
        }
        gl.bindBuffer(gl.ARRAY_BUFFER, sample.buffer);
        if (sample.count !== robots.count) {
            gl.bufferData(gl.ARRAY_BUFFER, robots.shown, gl.DYNAMIC_DRAW);
        } else {
            gl.bufferSubData(gl.ARRAY_BUFFER, 0, robots.shown);
        }
        sample.count = robots.count;
        sample.version = robots.version;
        sample.hasLeds = robots.led.some((led) => led > 0);
    }

    /**
     * @param {Program} program
     * @param {Robots} robots
     * @param {boolean} hasShares
     */
    readRobots(program, robots, hasShares) {
        const { gl } = this;
        const { x, y, z, heading, led, state, isThere } = robots;
        const { buffer } = this.sample;
        program.read(buffer, [[1, 1, x.byteOffset], [2, 1, y.byteOffset], [9, 1, z.byteOffset]], gl.INT);
        program.read(buffer, [[3, 1, heading.byteOffset]], gl.UNSIGNED_SHORT);
        program.read(buffer, [[4, 1, led.byteOffset], [5, 1, state.byteOffset], [6, 1, isThere.byteOffset]], gl.UNSIGNED_BYTE);
        program.read(this.radii, [[7, 1, 0]], gl.FLOAT);
        program.read(this.glyphs, [[10, 1, 0]], gl.FLOAT);
        if (this.leans.count > 0) {
            program.read(this.leans.buffer, [[11, 3, 0]], gl.FLOAT);
        } else {
            gl.disableVertexAttribArray(11);
            gl.vertexAttrib3f(11, 0, 0, -1);
        }
        if (hasShares && this.shares) {
            program.read(this.shares.buffer, [[8, 1, 0]], gl.FLOAT);
        } else {
            gl.disableVertexAttribArray(8);
            gl.vertexAttrib1f(8, -1);
        }
    }

    /**
     * @param {WebGLBuffer} buffer
     * @param {Float32Array<ArrayBuffer>} numbers
     */
    fill(buffer, numbers) {
        const { gl } = this;
        gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
        gl.bufferData(gl.ARRAY_BUFFER, numbers, gl.DYNAMIC_DRAW);
    }
}
