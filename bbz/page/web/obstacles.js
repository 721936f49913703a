// Obstacles: their outlines on the ground, and in 3-D their edges, so that robots behind them are seen.

import { SHAPES } from "./scene.js";

// Corners of the upper edge of a disc, and of these the share with an edge down to the ground.
const CORNERS = 32;
const EDGE_EVERY = 8;
// The height to which obstacles are drawn that no robot gets over, as a share of the shorter side of the world.
const TALL = 0.15;

export class Obstacles {
    constructor(scene) {
        this.scene = scene;
        this.edges = scene.makeLines();
        this.obstacles = [];
        // The height of the highest in mm.
        this.top = 0;
    }

    // Obstacles as an event tells them, in a world of a size in mm.
    set(obstacles, size) {
        const tall = TALL * Math.min(...size);
        this.obstacles = obstacles;
        this.top = Math.max(0, ...obstacles.map(({ height }) => height ?? tall));
        const edges = obstacles.flatMap((obstacle) => edgesOf(obstacle, obstacle.height ?? tall));
        this.scene.setLines(this.edges, Float32Array.from(edges.flat(2), (mm) => 10 * mm));
    }

    draw(colour, isTilted) {
        const { scene } = this;
        for (const { at, from, to, radius, size } of this.obstacles) {
            if (from) {
                scene.addLine(from, to, 2, colour);
            } else if (radius) {
                scene.add(...at, radius, radius, 0, SHAPES.disc, colour);
            } else {
                scene.add(...at, size[0] / 2, size[1] / 2, 0, SHAPES.box, colour);
            }
        }
        if (isTilted) {
            scene.drawLines(this.edges, colour, 1);
        }
    }
}

// Pairs of places in mm: the upper edge, and edges down to the ground.
function edgesOf(obstacle, height) {
    const corners = cornersOf(obstacle);
    const every = obstacle.radius ? EDGE_EVERY : 1;
    return corners.flatMap(([x, y], corner) => {
        const [nextX, nextY] = corners[(corner + 1) % corners.length];
        const above = [[x, y, height], [nextX, nextY, height]];
        return corner % every === 0 ? [above, [[x, y, 0], [x, y, height]]] : [above];
    });
}

function cornersOf({ at, from, to, radius, size }) {
    if (from) {
        return [from, to];
    }
    const [x, y] = at;
    if (radius) {
        return Array.from({ length: CORNERS }, (_, corner) => {
            const angle = (2 * Math.PI * corner) / CORNERS;
            return [x + radius * Math.cos(angle), y + radius * Math.sin(angle)];
        });
    }
    const [right, up] = [size[0] / 2, size[1] / 2];
    return [[x - right, y - up], [x + right, y - up], [x + right, y + up], [x - right, y + up]];
}
