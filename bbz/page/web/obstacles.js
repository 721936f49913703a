// Obstacles: their outlines on the ground, and in 3-D their edges, so that robots behind them are seen.

import { SHAPES } from "./scene.js";

// Corners of the upper edge of a disc, and of these the share with an edge down to the ground.
const CORNERS = 32;
const EDGE_EVERY = 8;
// The height to which obstacles are drawn that no robot gets over, as a share of the shorter side of the world.
const TALL = 0.15;

// The ring on a disc that robots push, as a share of its radius. It tells such a disc from an obstacle without its color.
export const RING = 0.6;

/**
 * @import { MovableDescription, ObstacleDescription } from "./events"
 * @import { Color, Lines, Place, SpacePlace } from "./page"
 * @import { Robots } from "./recording.js"
 * @import { Scene } from "./scene.js"
 */

/** @typedef {{ obstacle: Color, movable: Color, ground: Color }} ObstacleColors */

export class Obstacles {
    /** @param {Scene} scene */
    constructor(scene) {
        this.scene = scene;
        this.edges = scene.makeLines();
        this.movableEdges = scene.makeLines();
        /** @type {ObstacleDescription[]} */
        this.obstacles = [];
        /** @type {MovableDescription[]} */
        this.movables = [];
        // The version of the samples whose places the edges of movable discs have.
        this.version = -1;
        // The height of obstacles without one, and of the highest, in mm.
        this.tall = 0;
        this.top = 0;
    }

    // `size` is that of the world in mm.
    /**
     * @param {ObstacleDescription[]} obstacles
     * @param {MovableDescription[]} movables
     * @param {Place} size
     */
    set(obstacles, movables, size) {
        this.tall = TALL * Math.min(...size);
        this.obstacles = obstacles;
        this.movables = movables;
        this.version = -1;
        this.top = [...obstacles, ...movables].reduce((most, { height }) => Math.max(most, height ?? this.tall), 0);
        this.setEdges(this.edges, obstacles);
    }

    /**
     * @param {Lines} lines
     * @param {ObstacleDescription[]} obstacles
     */
    setEdges(lines, obstacles) {
        const edges = obstacles.flatMap((obstacle) => edgesOf(obstacle, obstacle.height ?? this.tall));
        this.scene.setLines(lines, Float32Array.from(edges.flat(2), (mm) => 10 * mm));
    }

    /**
     * @param {ObstacleColors} colors
     * @param {Robots} robots
     */
    draw(colors, robots) {
        const color = colors.obstacle;
        const { scene } = this;
        const { isTilted } = scene.camera;
        for (const obstacle of this.obstacles) {
            if ("from" in obstacle) {
                scene.addLine(obstacle.from, obstacle.to, 2, color);
            } else if ("radius" in obstacle) {
                scene.add(...obstacle.at, obstacle.radius, obstacle.radius, 0, SHAPES.disc, color);
            } else {
                scene.add(...obstacle.at, obstacle.size[0] / 2, obstacle.size[1] / 2, radians(obstacle.heading), SHAPES.box, color);
            }
        }
        const placed = placedMovables(this.movables, robots);
        for (const { at, radius } of placed) {
            scene.add(...at, radius, radius, 0, SHAPES.disc, colors.movable);
            scene.add(...at, RING * radius, RING * radius, 0, SHAPES.ring, colors.ground);
        }
        if (!isTilted) {
            return;
        }
        scene.drawLines(this.edges, color, 1);
        if (this.version !== robots.version) {
            this.version = robots.version;
            this.setEdges(this.movableEdges, placed);
        }
        scene.drawLines(this.movableEdges, colors.movable, 1);
    }
}

// Discs that robots push, where they are. The places come with the first sample.
/**
 * @param {MovableDescription[]} movables
 * @param {Robots} robots
 */
export function placedMovables(movables, robots) {
    return movables.slice(0, robots.movables.length / 2).map((movable, disc) => {
        /** @type {Place} */
        const at = [robots.movables[2 * disc] / 10, robots.movables[2 * disc + 1] / 10];
        return { at, ...movable };
    });
}

// Pairs of places in mm: the upper edge, and edges down to the ground.
/**
 * @param {ObstacleDescription} obstacle
 * @param {number} height
 * @returns {SpacePlace[][]}
 */
function edgesOf(obstacle, height) {
    const corners = cornersOf(obstacle);
    const every = "radius" in obstacle ? EDGE_EVERY : 1;
    return corners.flatMap(([x, y], corner) => {
        const [nextX, nextY] = corners[(corner + 1) % corners.length];
        /** @type {SpacePlace[]} */
        const above = [[x, y, height], [nextX, nextY, height]];
        return corner % every === 0 ? [above, [[x, y, 0], [x, y, height]]] : [above];
    });
}

/**
 * @param {ObstacleDescription} obstacle
 * @returns {Place[]}
 */
function cornersOf(obstacle) {
    if ("from" in obstacle) {
        return [obstacle.from, obstacle.to];
    }
    const [x, y] = obstacle.at;
    if ("radius" in obstacle) {
        const { radius } = obstacle;
        return Array.from({ length: CORNERS }, (_, corner) => {
            const angle = (2 * Math.PI * corner) / CORNERS;
            return [x + radius * Math.cos(angle), y + radius * Math.sin(angle)];
        });
    }
    const [halfWidth, halfHeight] = obstacle.size.map((length) => length / 2);
    const [cos, sin] = [Math.cos(radians(obstacle.heading)), Math.sin(radians(obstacle.heading))];
    /** @type {Place[]} */
    const corners = [[-halfWidth, -halfHeight], [halfWidth, -halfHeight], [halfWidth, halfHeight], [-halfWidth, halfHeight]];
    return corners.map(([along, across]) => [x + along * cos - across * sin, y + along * sin + across * cos]);
}

/** @param {number} degrees */
export function radians(degrees) {
    return (degrees * Math.PI) / 180;
}
