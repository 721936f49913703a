// What the view looks at: all robots, or the chosen one, with the range of its messages.

/**
 * @import { Group, SpacePlace, World } from "./page"
 * @import { View } from "./view.js"
 */

// A part of the picture that robots fill, and the largest radius of a body in pixels.
const FILLED = 0.8;
const RADIUS_PIXELS_MAX = 40;
// Dashes of a ring.
const DASHES = 60;

// Shows all robots as large as the picture has room.
/** @param {View} view */
export function fitRobots(view) {
    const { camera, robots, radii, scene } = view;
    const shown = { ...camera, x: 0, y: 0, scale: 1, project: camera.project };
    let [left, right, low, high, largest] = [Infinity, -Infinity, Infinity, -Infinity, 0];
    for (let robot = 0; robot < robots.count; robot++) {
        if (robots.isThere[robot]) {
            const [x, y] = shown.project(...view.spaceOf(robot));
            const radius = radii[robot];
            [left, right, low, high] = [Math.min(left, x - radius), Math.max(right, x + radius), Math.min(low, y - radius), Math.max(high, y + radius)];
            largest = Math.max(largest, radius);
        }
    }
    if (largest > 0) {
        const scale = Math.min(scene.width / (right - left), scene.height / (high - low)) * FILLED;
        camera.scale = Math.min(scale, RADIUS_PIXELS_MAX / largest);
        lookAt(view, (left + right) / 2 * camera.scale, (low + high) / 2 * camera.scale);
    }
}

// Puts the chosen robot into the middle of the picture.
/** @param {View} view */
export function follow(view) {
    if (view.chosen !== null && view.robots.isThere[view.chosen]) {
        const [x, y, z] = view.spaceOf(view.chosen);
        const [right, up] = view.camera.project(x, y, z);
        const [wayX, wayY] = view.camera.way(right, up);
        view.camera.x += wayX;
        view.camera.y += wayY;
        view.isFitted = false;
        view.changed();
    }
}

// Puts a point into the middle, which is given in pixels from the origin of the world.
/**
 * @param {View} view
 * @param {number} right
 * @param {number} up
 */
function lookAt(view, right, up) {
    [view.camera.x, view.camera.y] = view.camera.way(right, up);
    view.isFitted = false;
    view.changed();
}

// The distance in mm from the middle of a robot to that of another one of its group that its messages still reach; `null`: any.
/** @param {Group} group */
export function reachOf({ link, radius }) {
    return link?.range === null || !link ? null : link.range + (link.is_between_rims ? 2 * radius : 0);
}

/**
 * @param {World} world
 * @param {number} robot
 */
export function groupOf({ groups }, robot) {
    return groups.find(({ first, count }) => robot < first + count);
}

// The dashes of a ring around a place, as pairs of places.
/**
 * @param {SpacePlace} middle
 * @param {number} radius
 * @returns {SpacePlace[][]}
 */
export function dashes([x, y, z], radius) {
    /** @type {(share: number) => SpacePlace} */
    const at = (share) => {
        const angle = share * 2 * Math.PI;
        return [x + radius * Math.cos(angle), y + radius * Math.sin(angle), z];
    };
    return Array.from({ length: DASHES }, (_, dash) => [at(dash / DASHES), at((dash + 0.55) / DASHES)]);
}
