// Obstacles: their outlines on the ground, and in 3-D their edges, so that robots behind them are seen.

import { SHAPES } from "./scene.js";

// Corners of the upper edge of a disc, and of these the share with an edge down to the ground.
const CORNERS = 32;
const EDGE_EVERY = 8;
// The height to which obstacles are drawn that no robot gets over, as a share of the shorter side of the world.
const TALL = 0.15;

/**
 * @import { ObstacleDescription } from "./events"
 * @import { Color, Place, SpacePlace } from "./page"
 * @import { Scene } from "./scene.js"
 */

export class Obstacles {
    /** @param {Scene} scene */
    constructor(scene) {
        this.scene = scene;
        this.edges = scene.makeLines();
        /** @type {ObstacleDescription[]} */
        this.obstacles = [];
        // The height of the highest in mm.
        this.top = 0;
    }

    // `size` is that of the world in mm.
    /**
     * @param {ObstacleDescription[]} obstacles
     * @param {Place} size
     */
    set(obstacles, size) {
        const tall = TALL * Math.min(...size);
        this.obstacles = obstacles;
        this.top = Math.max(0, ...obstacles.map(({ height }) => height ?? tall));
        const edges = obstacles.flatMap((obstacle) => edgesOf(obstacle, obstacle.height ?? tall));
        this.scene.setLines(this.edges, Float32Array.from(edges.flat(2), (mm) => 10 * mm));
    }

    /**
     * @param {Color} color
     * @param {boolean} isTilted
     */
    draw(color, isTilted) {
        const { scene } = this;
        for (const obstacle of this.obstacles) {
            if ("from" in obstacle) {
                scene.addLine(obstacle.from, obstacle.to, 2, color);
            } else if ("radius" in obstacle) {
                scene.add(...obstacle.at, obstacle.radius, obstacle.radius, 0, SHAPES.disc, color);
            } else {
                scene.add(...obstacle.at, obstacle.size[0] / 2, obstacle.size[1] / 2, radians(obstacle.heading), SHAPES.box, color);
            }
        }
        if (isTilted) {
            scene.drawLines(this.edges, color, 1);
        }
    }
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
