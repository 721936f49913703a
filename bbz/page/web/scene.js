// The world in WebGL 2: everything is a square with a shape in it, drawn in one call.

// Numbers of an instance: middle, half size, angle, shape, colour, LED, flags.
const WIDTH = 12;

export const SHAPES = { robot: 0, disc: 1, box: 2, light: 3, ring: 4, grid: 5 };

const VERTEX = `#version 300 es
layout(location = 0) in vec2 corner;
layout(location = 1) in vec2 middle;
layout(location = 2) in vec2 extent;
layout(location = 3) in vec2 angleAndShape;
layout(location = 4) in vec4 paint;
layout(location = 5) in vec2 ledAndFlags;
uniform vec4 view; // middle in mm, scale to clip space
out vec2 at;
out vec2 size;
flat out float shape;
flat out vec4 colour;
flat out vec2 shown;
out vec2 place;
void main() {
    at = corner * (angleAndShape.y > 4.5 ? 1.0 : 1.3);
    size = extent;
    shape = angleAndShape.y;
    colour = paint;
    shown = ledAndFlags;
    float s = sin(angleAndShape.x), c = cos(angleAndShape.x);
    vec2 turned = mat2(c, s, -s, c) * (at * extent);
    place = middle + turned;
    gl_Position = vec4((place - view.xy) * view.zw, 0.0, 1.0);
}`;

const FRAGMENT = `#version 300 es
precision highp float;
in vec2 at;
in vec2 size;
flat in float shape;
flat in vec4 colour;
flat in vec2 shown;
in vec2 place;
uniform vec4 edge; // colour of outlines
out vec4 result;
float cover(float distance) {
    return clamp(0.5 - distance / max(fwidth(distance), 1e-5), 0.0, 1.0);
}
void main() {
    float r = length(at);
    if (shape < 0.5) {
        float body = cover(r - 1.0);
        vec3 inside = colour.rgb;
        int led = int(shown.x);
        if (led > 0) {
            vec3 lamp = vec3(float(led & 1), float((led >> 1) & 1), float((led >> 2) & 1));
            inside = mix(inside, lamp * 0.85 + 0.1, cover(r - 0.62));
        }
        // A notch shows the way ahead.
        float nose = max(abs(at.y) - 0.14, 0.4 - at.x);
        inside = mix(inside, edge.rgb, cover(nose));
        inside = mix(inside, edge.rgb, 1.0 - cover(r - 0.88));
        result = vec4(inside, body * colour.a);
    } else if (shape < 1.5) {
        result = vec4(colour.rgb, colour.a * cover(r - 1.0));
    } else if (shape < 2.5) {
        vec2 beyond = abs(at) - 1.0;
        result = vec4(colour.rgb, colour.a * cover(max(beyond.x, beyond.y)));
    } else if (shape < 3.5) {
        result = vec4(colour.rgb, colour.a * exp(-4.0 * r * r) * cover((r - 1.2) * 0.5));
    } else if (shape < 4.5) {
        result = vec4(colour.rgb, colour.a * cover(abs(r - 1.12) - 0.09));
    } else {
        // Lines at multiples of shown.x mm.
        vec2 cell = abs(fract(place / shown.x + 0.5) - 0.5) / fwidth(place / shown.x);
        result = vec4(colour.rgb, colour.a * clamp(1.0 - min(cell.x, cell.y), 0.0, 1.0));
    }
    if (result.a < 0.01) discard;
}`;

export class Scene {
    constructor(canvas) {
        const gl = canvas.getContext("webgl2", { antialias: true });
        if (!gl) {
            throw new Error("WebGL 2");
        }
        this.gl = gl;
        this.canvas = canvas;
        this.count = 0;
        this.data = new Float32Array(WIDTH * 1024);
        const program = link(gl, VERTEX, FRAGMENT);
        gl.useProgram(program);
        this.view = gl.getUniformLocation(program, "view");
        this.edge = gl.getUniformLocation(program, "edge");
        const corners = gl.createBuffer();
        gl.bindBuffer(gl.ARRAY_BUFFER, corners);
        gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]), gl.STATIC_DRAW);
        gl.enableVertexAttribArray(0);
        gl.vertexAttribPointer(0, 2, gl.FLOAT, false, 0, 0);
        this.instances = gl.createBuffer();
        gl.bindBuffer(gl.ARRAY_BUFFER, this.instances);
        let offset = 0;
        for (const [index, length] of [[1, 2], [2, 2], [3, 2], [4, 4], [5, 2]]) {
            gl.enableVertexAttribArray(index);
            gl.vertexAttribPointer(index, length, gl.FLOAT, false, WIDTH * 4, offset);
            gl.vertexAttribDivisor(index, 1);
            offset += length * 4;
        }
        gl.enable(gl.BLEND);
        gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    }

    begin() {
        this.count = 0;
    }

    // Middle and half size in mm, angle in radians, colour as four numbers from 0 to 1.
    add(x, y, halfWidth, halfHeight, angle, shape, colour, led = 0, flags = 0) {
        const at = this.count * WIDTH;
        if (at + WIDTH > this.data.length) {
            const larger = new Float32Array(this.data.length * 2);
            larger.set(this.data);
            this.data = larger;
        }
        const data = this.data;
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
        data[at + 10] = led;
        data[at + 11] = flags;
        this.count += 1;
    }

    // `view` has the middle in mm and the pixels of the screen for one mm.
    draw(view, background, edge) {
        const { gl, canvas } = this;
        const ratio = globalThis.devicePixelRatio || 1;
        const width = Math.round(canvas.clientWidth * ratio);
        const height = Math.round(canvas.clientHeight * ratio);
        if (canvas.width !== width || canvas.height !== height) {
            canvas.width = width;
            canvas.height = height;
        }
        gl.viewport(0, 0, width, height);
        gl.clearColor(...background);
        gl.clear(gl.COLOR_BUFFER_BIT);
        const scale = view.scale * ratio * 2;
        gl.uniform4f(this.view, view.x, view.y, scale / width, scale / height);
        gl.uniform4f(this.edge, ...edge);
        gl.bufferData(gl.ARRAY_BUFFER, this.data.subarray(0, this.count * WIDTH), gl.STREAM_DRAW);
        gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, this.count);
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
