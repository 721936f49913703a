// Programs of the graphics card. Each fades the edges of what it draws.

// Radius of the glow of an LED, in radii of the body.
export const GLOW = 2.2;
// Colors from the lowest share to the highest.
const STEPS = 6;

const HEAD = `#version 300 es
precision highp float;`;

// From mm to clip space.
const PROJECT = `
uniform vec4 view; // middle in mm, scale to clip space
uniform mat3x2 axes; // the ways of x, y and z in the picture
vec2 project(vec3 place) {
    return axes * vec3(place.xy - view.xy, place.z) * view.zw;
}`;

export const SHAPE_VERTEX = `${HEAD}
layout(location = 1) in vec2 middle;
layout(location = 2) in vec2 extent;
layout(location = 3) in vec2 angleAndShape;
layout(location = 4) in vec4 paint;
layout(location = 5) in float height;
${PROJECT}
out vec2 at;
flat out float shape;
flat out vec4 color;
void main() {
    at = vec2(gl_VertexID & 1, (gl_VertexID >> 1) & 1) * 2.6 - 1.3;
    shape = angleAndShape.y;
    color = paint;
    float s = sin(angleAndShape.x), c = cos(angleAndShape.x);
    vec2 place = middle + mat2(c, s, -s, c) * (at * extent);
    gl_Position = vec4(project(vec3(place, height)), 0.0, 1.0);
}`;

export const SHAPE_FRAGMENT = `${HEAD}
in vec2 at;
flat in float shape;
flat in vec4 color;
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
    result = vec4(color.rgb, color.a * share);
}`;

export const LINE_VERTEX = `${HEAD}
layout(location = 1) in vec3 start; // tenths of mm, as samples have them
layout(location = 2) in vec3 end;
${PROJECT}
uniform vec2 canvas; // half its size in pixels
uniform float halfWidth; // in pixels
out float away;
void main() {
    vec2 from = project(start / 10.0) * canvas;
    vec2 to = project(end / 10.0) * canvas;
    vec2 along = (to - from) / max(length(to - from), 1e-6);
    away = (gl_VertexID & 2) == 0 ? halfWidth + 0.5 : -halfWidth - 0.5;
    vec2 place = ((gl_VertexID & 1) == 0 ? from : to) + vec2(-along.y, along.x) * away;
    gl_Position = vec4(place / canvas, 0.0, 1.0);
}`;

export const LINE_FRAGMENT = `${HEAD}
in float away;
uniform float halfWidth;
uniform vec4 paint;
out vec4 result;
void main() {
    result = vec4(paint.rgb, paint.a * clamp(halfWidth + 0.5 - abs(away), 0.0, 1.0));
}`;

// The whole canvas.
export const LAYER_VERTEX = `${HEAD}
void main() {
    gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0);
}`;

// One color.
export const FADE_FRAGMENT = `${HEAD}
uniform vec4 paint;
out vec4 result;
void main() {
    result = paint;
}`;

// A layer in one color.
export const LAYER_FRAGMENT = `${HEAD}
uniform sampler2D layer;
uniform vec4 paint;
out vec4 result;
void main() {
    result = vec4(paint.rgb, paint.a * texelFetch(layer, ivec2(gl_FragCoord.xy), 0).r);
}`;

// The bodies of all robots, or the glows of their LEDs; as points or as squares.
/** @type {(isPoint: boolean, isGlow: boolean) => string} */
export const robotVertex = (isPoint, isGlow) => `${HEAD}
layout(location = 0) in vec2 corner;
layout(location = 1) in float x; // tenths of mm
layout(location = 2) in float y;
layout(location = 3) in float heading;
layout(location = 4) in float led;
layout(location = 5) in float state;
layout(location = 6) in float isThere;
layout(location = 7) in float radius; // mm
layout(location = 8) in float share; // of the shown quantity; below 0 without one
layout(location = 9) in float z; // tenths of mm
${PROJECT}
uniform vec2 canvas;
uniform vec2 scale; // pixels for one mm, and of the least body
uniform vec3 dragged; // number of a robot, and its place in mm
uniform vec3 states[4];
uniform vec3 palette[${STEPS}];
uniform bool hasLeds;
uniform bool isShadow; // on the ground
out vec2 at;
flat out float span;
flat out float pixel;
flat out vec2 ahead;
flat out vec4 color;
flat out vec4 lamp;
void main() {
    int lit = hasLeds ? int(led) : 0;
    lamp = vec4(vec3(lit & 1, (lit >> 1) & 1, (lit >> 2) & 1) * 0.85 + 0.1, lit > 0 ? 1.0 : 0.0);
    float along = clamp(share, 0.0, 1.0) * ${(STEPS - 1).toFixed(1)};
    int low = min(int(along), ${STEPS - 2});
    vec3 ofShare = mix(palette[low], palette[low + 1], along - float(low));
    color = vec4(share < 0.0 ? states[clamp(int(state), 0, 3)] : ofShare, 1.0);
    float size = ${isGlow ? `radius * ${GLOW.toFixed(2)} * scale.x` : "max(radius * scale.x, scale.y)"};
    // An edge fades over a pixel, half of it outside.
    pixel = 1.0 / size;
    span = ${isGlow ? "1.0" : "1.0 + 0.5 * pixel"};
    float angle = heading * ${(2 * Math.PI / 65536).toFixed(12)};
    vec2 way = axes * vec3(cos(angle), sin(angle), 0.0);
    ahead = way / max(length(way), 1e-6);
    vec2 place = ${isPoint ? "gl_VertexID" : "gl_InstanceID"} == int(dragged.x) ? dragged.yz : vec2(x, y) / 10.0;
    vec2 middle = project(vec3(place, isShadow ? 0.0 : z / 10.0));
    ${isPoint ? "gl_PointSize = 2.0 * size * span;" : "at = corner * span; middle += at * size / canvas;"}
    bool isDrawn = isThere > 0.0 && ${isGlow ? "lit > 0" : "(z > 0.0 || !isShadow)"};
    gl_Position = isDrawn ? vec4(middle, 0.0, 1.0) : vec4(2.0, 2.0, 2.0, 1.0);
}`;

/** @type {(isPoint: boolean, isGlow: boolean) => string} */
export const robotFragment = (isPoint, isGlow) => `${HEAD}
in vec2 at;
flat in float span;
flat in float pixel;
flat in vec2 ahead;
flat in vec4 color;
flat in vec4 lamp;
uniform vec3 edge; // color of outlines
uniform vec4 shadow; // color, if it is one
uniform float depth; // length of one mm to the back, in a picture of one mm
out vec4 result;
float cover(float distance) {
    return clamp(0.5 - distance / pixel, 0.0, 1.0);
}
void main() {
    vec2 here = ${isPoint ? "(gl_PointCoord * 2.0 - 1.0) * vec2(span, -span)" : "at"};
    ${isGlow ? `
    // This is nearly a bell curve, and costs less: glows are most of the pixels that a swarm fills.
    float low = max(1.0 - dot(here, here), 0.0);
    result = vec4(lamp.rgb, 0.5 * low * low * low);` : `
    if (shadow.a > 0.0) {
        result = vec4(shadow.rgb, shadow.a * cover(length(here / vec2(1.0, depth)) - 1.0));
        return;
    }
    float r = length(here);
    vec3 inside = mix(color.rgb, lamp.rgb, lamp.a * cover(r - 0.62));
    // A notch shows the way ahead.
    float nose = max(abs(ahead.x * here.y - ahead.y * here.x) - 0.14, 0.4 - dot(ahead, here));
    inside = mix(inside, edge, max(cover(nose), cover(0.88 - r)));
    result = vec4(inside, cover(r - 1.0));`}
}`;

// A program and where its attributes are. They are those of each vertex, or with a divisor those of each instance.
export class Program {
    /**
     * @param {WebGL2RenderingContext} gl
     * @param {string} vertex
     * @param {string} fragment
     */
    constructor(gl, vertex, fragment, divisor = 0) {
        this.gl = gl;
        this.divisor = divisor;
        this.linked = link(gl, vertex, fragment);
        /** @type {Map<string, WebGLUniformLocation | null>} */
        this.uniforms = new Map();
        this.attributes = gl.createVertexArray();
    }

    use() {
        this.gl.useProgram(this.linked);
        this.gl.bindVertexArray(this.attributes);
    }

    /** @param {string} uniform */
    at(uniform) {
        if (!this.uniforms.has(uniform)) {
            this.uniforms.set(uniform, this.gl.getUniformLocation(this.linked, uniform));
        }
        return this.uniforms.get(uniform) ?? null;
    }

    // Reads attributes from a buffer: of each its place, how many numbers, and its first byte.
    /**
     * @param {WebGLBuffer} buffer
     * @param {[number, number, number][]} attributes
     * @param {number} type
     */
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

/**
 * @param {WebGL2RenderingContext} gl
 * @param {string[]} sources
 */
function link(gl, ...sources) {
    const program = gl.createProgram();
    [gl.VERTEX_SHADER, gl.FRAGMENT_SHADER].forEach((kind, index) => {
        const shader = /** @type {WebGLShader} */ (gl.createShader(kind));
        gl.shaderSource(shader, sources[index]);
        gl.compileShader(shader);
        if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) {
            throw new Error(gl.getShaderInfoLog(shader) ?? "");
        }
        gl.attachShader(program, shader);
    });
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
        throw new Error(gl.getProgramInfoLog(program) ?? "");
    }
    return program;
}
