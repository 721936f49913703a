// Programs of the graphics card. Each fades the edges of what it draws.

export const HEAD = `#version 300 es
precision highp float;`;

// From mm to clip space.
export const PROJECT = `
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
