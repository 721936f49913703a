// The world in WebGL 2.
//
// Bodies and glows are drawn from the samples as they are: their numbers go to the graphics card once for each sample, and all
// robots take one call. Lines between robots and trails go there when they change. Only shapes, of which there are few, are placed
// for each picture. The ground is cleared, not painted.
//
// A processor that computes WebGL (SwiftShader) takes as long for an instance as for a call, and for a robot as a point a quarter
// of the time of a square. So robots are points, and lines and shapes are squares of four corners, without instances. Each program
// fades the edges of what it draws, so the canvas needs only one sample for a pixel.

export const SHAPES = { disc: 0, box: 1, light: 2, ring: 3 };

// Numbers of a shape: middle, half size, angle, kind, colour.
const WIDTH = 10;
// Radius of the glow of an LED, in radii of the body. Below some pixels the body hides it.
const GLOW = 2.2;
const LEAST_GLOW = 1.5;
// Colours from the lowest share to the highest.
const STEPS = 6;

const HEAD = `#version 300 es
precision highp float;`;

const SHAPE_VERTEX = `${HEAD}
layout(location = 1) in vec2 middle;
layout(location = 2) in vec2 extent;
layout(location = 3) in vec2 angleAndShape;
layout(location = 4) in vec4 paint;
uniform vec4 view; // middle in mm, scale to clip space
out vec2 at;
flat out float shape;
flat out vec4 colour;
void main() {
    at = vec2(gl_VertexID & 1, (gl_VertexID >> 1) & 1) * 2.6 - 1.3;
    shape = angleAndShape.y;
    colour = paint;
    float s = sin(angleAndShape.x), c = cos(angleAndShape.x);
    vec2 place = middle + mat2(c, s, -s, c) * (at * extent);
    gl_Position = vec4((place - view.xy) * view.zw, 0.0, 1.0);
}`;

const SHAPE_FRAGMENT = `${HEAD}
in vec2 at;
flat in float shape;
flat in vec4 colour;
out vec4 result;
float cover(float distance) {
    return clamp(0.5 - distance / max(fwidth(distance), 1e-5), 0.0, 1.0);
}
void main() {
    float r = length(at);
    float share;
    if (shape < 0.5) {
        share = cover(r - 1.0);
    } else if (shape < 1.5) {
        share = cover(abs(at.x) - 1.0) * cover(abs(at.y) - 1.0);
    } else if (shape < 2.5) {
        share = exp(-4.0 * r * r) * cover((r - 1.2) * 0.5);
    } else {
        share = cover(abs(r - 1.12) - 0.09);
    }
    result = vec4(colour.rgb, colour.a * share);
}`;

const LINE_VERTEX = `${HEAD}
layout(location = 1) in vec4 ends; // tenths of mm, as samples have them
uniform vec4 view;
uniform vec2 canvas; // half its size in pixels
uniform float halfWidth; // in pixels
out float away;
void main() {
    vec2 from = (ends.xy / 10.0 - view.xy) * view.zw * canvas;
    vec2 to = (ends.zw / 10.0 - view.xy) * view.zw * canvas;
    vec2 along = (to - from) / max(length(to - from), 1e-6);
    away = (gl_VertexID & 2) == 0 ? halfWidth + 0.5 : -halfWidth - 0.5;
    vec2 place = ((gl_VertexID & 1) == 0 ? from : to) + vec2(-along.y, along.x) * away;
    gl_Position = vec4(place / canvas, 0.0, 1.0);
}`;

const LINE_FRAGMENT = `${HEAD}
in float away;
uniform float halfWidth;
uniform vec4 paint;
out vec4 result;
void main() {
    result = vec4(paint.rgb, paint.a * clamp(halfWidth + 0.5 - abs(away), 0.0, 1.0));
}`;

// The bodies of all robots, or the glows of their LEDs; as points or as squares.
const robotVertex = (isPoint, isGlow) => `${HEAD}
layout(location = 0) in vec2 corner;
layout(location = 1) in float x; // tenths of mm
layout(location = 2) in float y;
layout(location = 3) in float heading;
layout(location = 4) in float led;
layout(location = 5) in float state;
layout(location = 6) in float isThere;
layout(location = 7) in float radius; // mm
layout(location = 8) in float share; // of the shown quantity; below 0 without one
uniform vec4 view;
uniform vec2 canvas;
uniform vec2 scale; // pixels for one mm, and of the least body
uniform vec3 dragged; // number of a robot, and its place in mm
uniform vec3 states[4];
uniform vec3 palette[${STEPS}];
uniform bool hasLeds;
out vec2 at;
flat out float span;
flat out float pixel;
flat out vec2 ahead;
flat out vec4 colour;
flat out vec4 lamp;
void main() {
    int lit = hasLeds ? int(led) : 0;
    lamp = vec4(vec3(lit & 1, (lit >> 1) & 1, (lit >> 2) & 1) * 0.85 + 0.1, lit > 0 ? 1.0 : 0.0);
    float along = clamp(share, 0.0, 1.0) * ${(STEPS - 1).toFixed(1)};
    int low = min(int(along), ${STEPS - 2});
    vec3 ofShare = mix(palette[low], palette[low + 1], along - float(low));
    colour = vec4(share < 0.0 ? states[clamp(int(state), 0, 3)] : ofShare, 1.0);
    float size = ${isGlow ? `radius * ${GLOW.toFixed(2)} * scale.x` : "max(radius * scale.x, scale.y)"};
    // An edge fades over a pixel, half of it outside.
    pixel = 1.0 / size;
    span = ${isGlow ? "1.0" : "1.0 + 0.5 * pixel"};
    float angle = heading * ${(2 * Math.PI / 65536).toFixed(12)};
    ahead = vec2(cos(angle), sin(angle));
    vec2 place = ${isPoint ? "gl_VertexID" : "gl_InstanceID"} == int(dragged.x) ? dragged.yz : vec2(x, y) / 10.0;
    vec2 middle = (place - view.xy) * view.zw;
    ${isPoint ? "gl_PointSize = 2.0 * size * span;" : "at = corner * span; middle += at * size / canvas;"}
    bool isDrawn = isThere > 0.0 && ${isGlow ? "lit > 0" : "true"};
    gl_Position = isDrawn ? vec4(middle, 0.0, 1.0) : vec4(2.0, 2.0, 2.0, 1.0);
}`;

const robotFragment = (isPoint, isGlow) => `${HEAD}
in vec2 at;
flat in float span;
flat in float pixel;
flat in vec2 ahead;
flat in vec4 colour;
flat in vec4 lamp;
uniform vec3 edge; // colour of outlines
out vec4 result;
float cover(float distance) {
    return clamp(0.5 - distance / pixel, 0.0, 1.0);
}
void main() {
    vec2 here = ${isPoint ? "(gl_PointCoord * 2.0 - 1.0) * vec2(span, -span)" : "at"};
    ${isGlow ? `
    // Near a bell curve, for less: glows are most of the pixels that a swarm fills.
    float low = max(1.0 - dot(here, here), 0.0);
    result = vec4(lamp.rgb, 0.5 * low * low * low);` : `
    float r = length(here);
    vec3 inside = mix(colour.rgb, lamp.rgb, lamp.a * cover(r - 0.62));
    // A notch shows the way ahead.
    float nose = max(abs(ahead.x * here.y - ahead.y * here.x) - 0.14, 0.4 - dot(ahead, here));
    inside = mix(inside, edge, max(cover(nose), cover(0.88 - r)));
    result = vec4(inside, cover(r - 1.0));`}
}`;

export class Scene {
    constructor(canvas) {
        const gl = canvas.getContext("webgl2", { alpha: false, antialias: false, depth: false });
        if (!gl) {
            throw new Error("WebGL 2");
        }
        this.gl = gl;
        this.canvas = canvas;
        const corners = gl.createBuffer();
        gl.bindBuffer(gl.ARRAY_BUFFER, corners);
        gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]), gl.STATIC_DRAW);
        this.shapes = new Program(gl, SHAPE_VERTEX, SHAPE_FRAGMENT);
        this.segments = new Program(gl, LINE_VERTEX, LINE_FRAGMENT);
        const robot = (isPoint, isGlow) => {
            const program = new Program(gl, robotVertex(isPoint, isGlow), robotFragment(isPoint, isGlow), isPoint ? 0 : 1);
            program.read(corners, [[0, 2, 0]], gl.FLOAT);
            gl.vertexAttribDivisor(0, 0);
            return program;
        };
        // As squares, as points.
        this.bodies = [robot(false, false), robot(true, false)];
        this.glows = [robot(false, true), robot(true, true)];
        this.programs = [this.shapes, this.segments, ...this.bodies, ...this.glows];
        [, this.mostPoint] = gl.getParameter(gl.ALIASED_POINT_SIZE_RANGE);
        this.quads = { buffer: gl.createBuffer(), count: 0 };
        this.count = 0;
        this.data = new Float32Array(4 * WIDTH * 64);
        this.placed = gl.createBuffer();
        this.shapes.read(this.placed, [[1, 2, 0], [2, 2, 8], [3, 2, 16], [4, 4, 24]], gl.FLOAT, WIDTH * 4);
        // What the graphics card has of a sample.
        this.sample = { buffer: gl.createBuffer(), robots: null, version: null, count: 0, hasLeds: false };
        this.radii = gl.createBuffer();
        this.shares = null;
        gl.enable(gl.BLEND);
        gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
        this.measure();
    }

    // The canvas has another size.
    measure() {
        this.width = this.canvas.clientWidth;
        this.height = this.canvas.clientHeight;
    }

    // Begins a picture. `view` has the middle in mm and the pixels of the screen for one mm.
    begin(view, background) {
        const { gl, canvas } = this;
        const ratio = globalThis.devicePixelRatio || 1;
        const [width, height] = [this.width, this.height].map((length) => Math.round(length * ratio));
        if (canvas.width !== width || canvas.height !== height) {
            canvas.width = width;
            canvas.height = height;
        }
        this.count = 0;
        this.scale = view.scale * ratio;
        this.middle = [view.x, view.y];
        gl.viewport(0, 0, width, height);
        gl.clearColor(...background);
        gl.clear(gl.COLOR_BUFFER_BIT);
        for (const program of this.programs) {
            program.use();
            gl.uniform4f(program.at("view"), view.x, view.y, (this.scale * 2) / width, (this.scale * 2) / height);
            gl.uniform2f(program.at("canvas"), width / 2, height / 2);
        }
    }

    // Clears a rectangle around the middle of the world; `inside()` draws what is only seen there.
    ground(halfWidth, halfHeight, colour, inside) {
        const { gl } = this;
        const [left, bottom] = this.pixelOf(-halfWidth, -halfHeight).map(Math.round);
        const [right, top] = this.pixelOf(halfWidth, halfHeight).map(Math.round);
        this.flush();
        gl.enable(gl.SCISSOR_TEST);
        gl.scissor(left, bottom, right - left, top - bottom);
        gl.clearColor(...colour);
        gl.clear(gl.COLOR_BUFFER_BIT);
        inside();
        this.flush();
        gl.disable(gl.SCISSOR_TEST);
    }

    // Lines at multiples of `step` mm, each a pixel wide.
    grid(halfWidth, halfHeight, step, colour) {
        const half = 0.5 / this.scale;
        const reach = [this.canvas.width, this.canvas.height].map((pixels) => pixels / 2 / this.scale);
        [halfWidth, halfHeight].forEach((most, axis) => {
            const first = Math.ceil(Math.max(-most, this.middle[axis] - reach[axis]) / step);
            const last = Math.floor(Math.min(most, this.middle[axis] + reach[axis]) / step);
            for (let line = first; line <= last; line++) {
                // The middle of a pixel, so that the line is sharp.
                const pixel = Math.floor(this.pixelOf(line * step, line * step)[axis]) + 0.5;
                const at = (pixel - [this.canvas.width, this.canvas.height][axis] / 2) / this.scale + this.middle[axis];
                axis === 0 ? this.add(at, 0, half, halfHeight, 0, SHAPES.box, colour) : this.add(0, at, halfWidth, half, 0, SHAPES.box, colour);
            }
        });
    }

    // A place in pixels from the lower left corner.
    pixelOf(x, y) {
        return [(x - this.middle[0]) * this.scale + this.canvas.width / 2, (y - this.middle[1]) * this.scale + this.canvas.height / 2];
    }

    // Adds a shape. Middle and half size in mm, angle in radians, colour as four numbers from 0 to 1.
    add(x, y, halfWidth, halfHeight, angle, shape, colour) {
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
        data[at + 6] = colour[0];
        data[at + 7] = colour[1];
        data[at + 8] = colour[2];
        data[at + 9] = colour[3];
        for (let corner = 1; corner < 4; corner++) {
            data.copyWithin(at + corner * WIDTH, at, at + WIDTH);
        }
        this.count += 1;
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
    makeLines() {
        return { buffer: this.gl.createBuffer(), count: 0 };
    }

    dropLines(lines) {
        this.gl.deleteBuffer(lines.buffer);
    }

    // Four numbers for each line: its ends in tenths of mm.
    setLines(lines, ends, count = ends.length / 4) {
        const corners = new Float32Array(16 * count);
        for (let line = 0; line < count; line++) {
            for (let corner = 0; corner < 4; corner++) {
                for (let part = 0; part < 4; part++) {
                    corners[16 * line + 4 * corner + part] = ends[4 * line + part];
                }
            }
        }
        this.fill(lines.buffer, corners);
        lines.count = count;
    }

    // `halfWidth` in pixels of the page.
    drawLines(lines, colour, halfWidth) {
        if (lines.count > 0) {
            const { gl, segments } = this;
            this.flush();
            segments.use();
            segments.read(lines.buffer, [[1, 4, 0]], gl.FLOAT);
            gl.uniform4f(segments.at("paint"), ...colour);
            gl.uniform1f(segments.at("halfWidth"), halfWidth * (globalThis.devicePixelRatio || 1));
            this.drawQuads(segments, lines.count);
        }
    }

    // Squares of four corners each, in the order of their numbers.
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

    // The radii of all robots in mm.
    setRadii(radii) {
        this.fill(this.radii, Float32Array.from(radii));
        this.largest = radii.reduce((most, radius) => Math.max(most, radius), 0);
        this.sized = radii.length;
    }

    // From 0 to 1 for each robot, or something else for robots without one; `null`: by state.
    setShares(shares) {
        this.shares = shares && { buffer: this.shares?.buffer ?? this.gl.createBuffer(), count: shares.length };
        if (shares) {
            this.fill(this.shares.buffer, Float32Array.from(shares, (share) => (typeof share === "number" ? share : -1)));
        }
    }

    // All robots of a sample: `states` and `palette` are lists of colours, `dragged` a robot on its way to another place.
    drawRobots(robots, { states, palette, edge, leastPixels, dragged }) {
        const { gl } = this;
        this.flush();
        this.take(robots);
        const ratio = globalThis.devicePixelRatio || 1;
        const count = Math.min(robots.count, this.sized);
        const hasShares = this.shares !== null && this.shares.count >= count;
        const hasLeds = this.sample.hasLeds && this.shares === null;
        const radius = this.largest * this.scale;
        const layers = radius * GLOW >= LEAST_GLOW && hasLeds ? [[this.glows, radius * GLOW], [this.bodies, radius]] : [[this.bodies, radius]];
        for (const [programs, pixels] of layers) {
            // Half a pixel of the edge is beyond the radius.
            const isPoint = 2 * pixels + 2 < this.mostPoint;
            const program = programs[Number(isPoint)];
            program.use();
            this.readRobots(program, robots, hasShares);
            gl.uniform2f(program.at("scale"), this.scale, leastPixels * ratio);
            gl.uniform3f(program.at("dragged"), dragged?.robot ?? -1, ...(dragged?.at ?? [0, 0]));
            gl.uniform3fv(program.at("states"), states.flatMap((colour) => colour.slice(0, 3)));
            gl.uniform3fv(program.at("palette"), palette.flat().map((part) => part / 255));
            gl.uniform3f(program.at("edge"), ...edge.slice(0, 3));
            gl.uniform1i(program.at("hasLeds"), Number(hasLeds));
            if (isPoint) {
                gl.drawArrays(gl.POINTS, 0, count);
            } else {
                gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, count);
            }
        }
    }

    // Gives the graphics card a sample that it does not have yet.
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

    readRobots(program, robots, hasShares) {
        const { gl } = this;
        const { x, y, heading, led, state, isThere } = robots;
        const { buffer } = this.sample;
        program.read(buffer, [[1, 1, x.byteOffset], [2, 1, y.byteOffset]], gl.INT);
        program.read(buffer, [[3, 1, heading.byteOffset]], gl.UNSIGNED_SHORT);
        program.read(buffer, [[4, 1, led.byteOffset], [5, 1, state.byteOffset], [6, 1, isThere.byteOffset]], gl.UNSIGNED_BYTE);
        program.read(this.radii, [[7, 1, 0]], gl.FLOAT);
        if (hasShares) {
            program.read(this.shares.buffer, [[8, 1, 0]], gl.FLOAT);
        } else {
            gl.disableVertexAttribArray(8);
            gl.vertexAttrib1f(8, -1);
        }
    }

    fill(buffer, numbers) {
        const { gl } = this;
        gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
        gl.bufferData(gl.ARRAY_BUFFER, numbers, gl.DYNAMIC_DRAW);
    }
}

// A program and where its attributes are. They are those of each vertex, or with a divisor those of each instance.
class Program {
    constructor(gl, vertex, fragment, divisor = 0) {
        this.gl = gl;
        this.divisor = divisor;
        this.linked = link(gl, vertex, fragment);
        this.uniforms = new Map();
        this.attributes = gl.createVertexArray();
    }

    use() {
        this.gl.useProgram(this.linked);
        this.gl.bindVertexArray(this.attributes);
    }

    at(uniform) {
        if (!this.uniforms.has(uniform)) {
            this.uniforms.set(uniform, this.gl.getUniformLocation(this.linked, uniform));
        }
        return this.uniforms.get(uniform);
    }

    // Reads attributes from a buffer: of each its place, how many numbers, and its first byte.
    read(buffer, attributes, type, stride = 0) {
        const { gl } = this;
        gl.bindVertexArray(this.attributes);
        gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
        for (const [place, length, offset] of attributes) {
            gl.enableVertexAttribArray(place);
            gl.vertexAttribPointer(place, length, type, false, stride, offset);
            gl.vertexAttribDivisor(place, this.divisor);
        }
    }
}

function link(gl, ...sources) {
    const program = gl.createProgram();
    [gl.VERTEX_SHADER, gl.FRAGMENT_SHADER].forEach((kind, index) => {
        const shader = gl.createShader(kind);
        gl.shaderSource(shader, sources[index]);
        gl.compileShader(shader);
        if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) {
            throw new Error(gl.getShaderInfoLog(shader));
        }
        gl.attachShader(program, shader);
    });
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
        throw new Error(gl.getProgramInfoLog(program));
    }
    return program;
}
