// The programs that draw robots: their bodies, each as a glyph of its kind, and the glows of their LEDs.
//
// All robots take one call. A body is a square, or a point, in which each pixel computes how far it is away from the outlines of the
// glyph. From above the glyph lies in the picture. In 3-D it lies on the top of a cylinder, or on the plane in which a robot with
// rotors is tilted.

import { HEAD, PROJECT } from "./programs.js";

// Radius of the glow of an LED, in radii of the body.
export const GLOW = 2.2;
// Colors from the lowest share to the highest.
const STEPS = 6;
// Numbers of the glyphs.
export const GLYPHS = { disc: 0, legs: 1, wheels: 2, rotors: 3 };
// The parts of glyphs in radii of the body, with x ahead and y to the left. drawing.js draws the same ones.
export const PARTS = {
    // The disc, the LED, and the notch ahead.
    rim: 0.88, lamp: 0.62, notch: [0.4, 0.14],
    // Angles of the legs, and for the leg ahead and the others how far they are away and their radius.
    legs: [0, 2 * Math.PI / 3, -2 * Math.PI / 3], leg: [[0.78, 0.22], [0.84, 0.14]],
    // Middle of a wheel at the left, and its half length and half width.
    wheel: [0.83, 0.42, 0.17],
    // Middles and radius of rotors, half width of the arms, and radius of the middle part.
    rotor: [0.45, 0.36], arm: 0.09, hub: 0.34,
};
// Below so many pixels of a radius, all robots are discs: the parts of a glyph would be dust.
const GLYPH_PIXELS_MIN = 3.5;
// Height of a body in 3-D, and of its underside if it stands on legs, in radii.
export const BODY_HEIGHT = 0.9;
const LEG_HEIGHT = 0.45;

const number = (/** @type {number} */ value) => value.toFixed(4);

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
layout(location = 10) in float kind; // number of the glyph
layout(location = 11) in vec3 lean; // roll and pitch in radians, and thrust as a share of that in hover; below 0 if it is not known
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
flat out float glyph;
flat out float thrust;
flat out vec4 plane; // the ways ahead and to the left in the picture
flat out vec4 color;
flat out vec4 lamp;
void main() {
    int lit = hasLeds ? int(led) : 0;
    lamp = vec4(vec3(lit & 1, (lit >> 1) & 1, (lit >> 2) & 1) * 0.85 + 0.1, lit > 0 ? 1.0 : 0.0);
    float along = clamp(share, 0.0, 1.0) * ${(STEPS - 1).toFixed(1)};
    int low = min(int(along), ${STEPS - 2});
    vec3 ofShare = mix(palette[low], palette[low + 1], along - float(low));
    // A robot that has failed, or that an error has stopped, has no value of now.
    color = vec4(share < 0.0 || state > 1.0 ? states[clamp(int(state), 0, 3)] : ofShare, 1.0);
    float size = ${isGlow ? `radius * ${GLOW.toFixed(2)} * scale.x` : "max(radius * scale.x, scale.y)"};
    // An edge fades over a pixel, half of it outside.
    pixel = 1.0 / size;
    glyph = size < ${number(GLYPH_PIXELS_MIN)} ? 0.0 : kind;
    // In 3-D a body stands up.
    span = ${isGlow ? "1.0" : `1.0 + 0.5 * pixel + (isShadow ? 0.0 : ${number(BODY_HEIGHT)} * axes[2].y)`};
    float angle = heading * ${(2 * Math.PI / 65536).toFixed(12)};
    float s = sin(angle), c = cos(angle);
    vec3 ahead = vec3(c, s, 0.0), left = vec3(-s, c, 0.0);
    if (glyph == ${GLYPHS.rotors}.0) {
        // The nose sinks, and then the left side rises.
        vec3 up = vec3(0.0, 0.0, 1.0);
        vec3 nose = cos(lean.y) * ahead - sin(lean.y) * up;
        vec3 above = cos(lean.y) * up + sin(lean.y) * ahead;
        left = cos(lean.x) * left + sin(lean.x) * above;
        ahead = nose;
    }
    plane = vec4(axes * ahead, axes * left);
    thrust = lean.z < 0.0 ? float(z > 0.0) : lean.z;
    vec2 place = ${isPoint ? "gl_VertexID" : "gl_InstanceID"} == int(dragged.x) ? dragged.yz : vec2(x, y) / 10.0;
    vec2 middle = project(vec3(place, isShadow ? 0.0 : z / 10.0));
    ${isPoint ? "gl_PointSize = 2.0 * size * span;" : "at = corner * span; middle += at * size / canvas;"}
    bool isDrawn = isThere > 0.0 && ${isGlow ? "lit > 0" : "(z > 0.0 || !isShadow)"};
    gl_Position = isDrawn ? vec4(middle, 0.0, 1.0) : vec4(2.0, 2.0, 2.0, 1.0);
}`;

// The glyphs, at places of the body in its radii.
const GLYPH = `
float box(vec2 at, vec2 half_) {
    vec2 away = abs(at) - half_;
    return length(max(away, 0.0)) + min(max(away.x, away.y), 0.0);
}
// A notch shows the way ahead.
float notch(vec2 at) {
    return max(abs(at.y) - ${number(PARTS.notch[1])}, ${number(PARTS.notch[0])} - at.x);
}
vec4 drawDisc(vec2 at, float soft) {
    float r = length(at);
    vec3 inside = mix(color.rgb, lamp.rgb, lamp.a * cover(r - ${number(PARTS.lamp)}, soft));
    inside = mix(inside, edge, max(cover(notch(at), soft), cover(${number(PARTS.rim)} - r, soft)));
    return vec4(inside, cover(r - 1.0, soft));
}
float legs(vec2 at) {
    float away = length(at - vec2(${number(PARTS.leg[0][0])}, 0.0)) - ${number(PARTS.leg[0][1])};
${PARTS.legs.slice(1).map((angle) => `    away = min(away, length(at - ${number(PARTS.leg[1][0])} * vec2(${number(Math.cos(angle))}, ${number(Math.sin(angle))})) - ${number(PARTS.leg[1][1])});`).join("\n")}
    return away;
}
vec4 drawLegs(vec2 at, float soft) {
    float r = length(at), leg = legs(at);
    vec3 inside = mix(color.rgb, lamp.rgb, lamp.a * cover(r - ${number(PARTS.lamp - 0.06)}, soft));
    inside = mix(inside, edge, cover(${number(PARTS.rim - 0.12)} - r, soft));
    inside = mix(inside, limb, cover(leg, soft));
    return vec4(inside, cover(min(r - ${number(PARTS.rim)}, leg), soft));
}
vec4 drawWheels(vec2 at, float soft) {
    float r = length(at);
    float wheel = box(vec2(at.x, abs(at.y) - ${number(PARTS.wheel[0])}), vec2(${number(PARTS.wheel[1])}, ${number(PARTS.wheel[2])}) - 0.08) - 0.08;
    vec3 inside = mix(color.rgb, lamp.rgb, lamp.a * cover(r - ${number(PARTS.lamp)}, soft));
    inside = mix(inside, edge, max(cover(notch(at), soft), cover(${number(PARTS.rim - 0.1)} - r, soft)));
    inside = mix(inside, limb, cover(wheel, soft));
    return vec4(inside, cover(min(r - ${number(PARTS.rim)}, wheel), soft));
}
vec4 drawRotors(vec2 at, float soft) {
    vec2 corner = abs(at);
    float rotor = length(corner - ${number(PARTS.rotor[0])}) - ${number(PARTS.rotor[1])};
    // The arms lead from the middle to the rotors.
    float arm = max(abs(corner.x - corner.y) * 0.7071 - ${number(PARTS.arm)}, corner.x + corner.y - ${number(2 * PARTS.rotor[0])});
    float hub = length(at) - ${number(PARTS.hub)};
    float nose = max(abs(at.y) - 0.5 * (0.72 - at.x), 0.2 - at.x);
    // Rotors are the denser the more they thrust, and the front ones are filled.
    float dense = clamp(0.25 + 0.4 * thrust, 0.25, 0.9);
    float blades = cover(rotor, soft) * mix(dense, 1.0, cover(abs(rotor + 0.05) - 0.05, soft));
    float all = max(max(blades, cover(arm, soft)), max(cover(hub, soft), cover(nose, soft)));
    vec3 inside = mix(color.rgb, limb, max(cover(arm, soft), max(cover(nose, soft), cover(abs(hub + 0.05) - 0.05, soft))));
    inside = mix(inside, mix(color.rgb, lamp.rgb, lamp.a), cover(hub + 0.1, soft));
    return vec4(inside, all);
}
vec4 draw(vec2 at, float soft) {
    if (glyph == ${GLYPHS.legs}.0) {
        return drawLegs(at, soft);
    }
    if (glyph == ${GLYPHS.wheels}.0) {
        return drawWheels(at, soft);
    }
    return glyph == ${GLYPHS.rotors}.0 ? drawRotors(at, soft) : drawDisc(at, soft);
}`;

/** @type {(isPoint: boolean, isGlow: boolean) => string} */
export const robotFragment = (isPoint, isGlow) => `${HEAD}
in vec2 at;
flat in float span;
flat in float pixel;
flat in float glyph;
flat in float thrust;
flat in vec4 plane;
flat in vec4 color;
flat in vec4 lamp;
uniform vec3 edge; // color of outlines
uniform vec3 limb; // color of wheels, legs and arms, which lie on the ground
uniform vec4 shadow; // color, if it is one
uniform vec2 depth; // length of one mm to the back and of one mm of height, in a picture of one mm
out vec4 result;
float cover(float distance, float soft) {
    return clamp(0.5 - distance / soft, 0.0, 1.0);
}
${isGlow ? "" : GLYPH}
void main() {
    vec2 here = ${isPoint ? "(gl_PointCoord * 2.0 - 1.0) * vec2(span, -span)" : "at"};
    ${isGlow ? `
    // This is nearly a bell curve, and costs less: glows are most of the pixels that a swarm fills.
    float low = max(1.0 - dot(here, here), 0.0);
    result = vec4(lamp.rgb, 0.5 * low * low * low);` : `
    if (shadow.a > 0.0) {
        result = vec4(shadow.rgb, shadow.a * cover(length(here / vec2(1.0, depth.x)) - 1.0, pixel / depth.x));
        return;
    }
    // The place on the top of the body.
    float low = glyph == ${GLYPHS.legs}.0 ? ${number(LEG_HEIGHT)} * depth.y : 0.0;
    float high = glyph == ${GLYPHS.rotors}.0 ? 0.0 : ${number(BODY_HEIGHT)} * depth.y;
    vec2 top = here - vec2(0.0, high);
    float area = plane.x * plane.w - plane.y * plane.z;
    // A plane that is seen from its edge has no area.
    area = abs(area) < 0.1 ? (area < 0.0 ? -0.1 : 0.1) : area;
    vec2 place = vec2(top.x * plane.w - top.y * plane.z, top.y * plane.x - top.x * plane.y) / area;
    result = draw(place, pixel / (depth.y > 0.0 ? abs(area) : 1.0));
    if (high > 0.0) {
        float rim = glyph == 0.0 ? 1.0 : ${number(PARTS.rim)};
        // The side of the cylinder, and the legs below it.
        float below = length(vec2(here.x, (here.y - clamp(here.y, low, high)) / depth.x)) - rim;
        float side = max(below, here.y > high ? here.y - high : below);
        float share = cover(side, pixel / depth.x);
        if (low > 0.0) {
${PARTS.legs.map((angle) => `            { vec2 foot = ${number(PARTS.leg[1][0])} * (plane.xy * ${number(Math.cos(angle))} + plane.zw * ${number(Math.sin(angle))});
              vec2 away = here - foot; share = max(share, cover(length(vec2(away.x, away.y - clamp(away.y, 0.0, low + 0.1))) - 0.07, pixel)); }`).join("\n")}
        }
        vec4 wall = vec4(mix(color.rgb, edge, 0.55), share);
        float all = result.a + wall.a * (1.0 - result.a);
        result = vec4((result.rgb * result.a + wall.rgb * wall.a * (1.0 - result.a)) / max(all, 1e-5), all);
    }`}
}`;
