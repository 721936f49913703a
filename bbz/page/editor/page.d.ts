// Types of the page's scripts that are not types of the session.

import type { BeginEvent, ExpectationDescription, GroupDescription, PageEvent, Request, VerdictName } from "./events";

// Parts of index.html that are more than an HTMLElement.
export interface Parts {
    "add-curve": HTMLSelectElement;
    "break-chosen": HTMLInputElement;
    canvas: HTMLCanvasElement;
    color: HTMLSelectElement;
    explanation: HTMLDialogElement;
    follow: HTMLInputElement;
    help: HTMLDialogElement;
    keep: HTMLInputElement;
    labels: HTMLCanvasElement;
    language: HTMLSelectElement;
    "show-labels": HTMLInputElement;
    "keep-changes": HTMLInputElement;
    messages: HTMLInputElement;
    rate: HTMLSelectElement;
    "run-on": HTMLSelectElement;
    "script-name": HTMLSelectElement;
    "step-values": HTMLDetailsElement;
    "stop-on-error": HTMLInputElement;
    tilted: HTMLInputElement;
    time: HTMLInputElement;
    trails: HTMLInputElement;
}

// Scripts of the address that the playground could not run: texts by their files.
export interface OfferedEvent {
    event: "offered";
    scripts: Texts;
}

export type ShownEvent = PageEvent | OfferedEvent;

// Functions by the names of the events that they take.
export type Handlers = { [Name in ShownEvent["event"]]: (event: Extract<ShownEvent, { event: Name }>) => void };

// Texts by the files that they replace.
export type Texts = Record<string, string>;

// The receiver of a session's messages.
export interface Receiver {
    onEvent(event: ShownEvent): void;
    onSample(bytes: Uint8Array): void;
    onEnd(text: string): void;
    // Another page has the session; `takeOver` asks for it.
    onWait(takeOver: () => void): void;
    // The session has not answered for some seconds; `null`: it answers again.
    onLate(seconds: number | null): void;
}

export type Ask = (request: Request) => void;

export interface Connection {
    ask: Ask;
    // The playground alone has these.
    link?: (scripts: Texts) => Promise<string>;
    exportPage?: (scripts: Texts) => Promise<string>;
}

// The number of the first robot is added to each group, and the last verdict to each expectation.
export type Group = GroupDescription & { first: number };
export type Expectation = ExpectationDescription & { verdict?: VerdictName; tick?: number | null };
export type World = Omit<BeginEvent, "groups" | "expectations"> & { groups: Group[]; expectations: Expectation[] };

// A place in mm: x and y, in space also z.
export type Place = [number, number];
export type SpacePlace = [number, number, number];

// Red, green, blue and opacity from 0 to 1.
export type Color = number[];

// Lines that stay the same for several pictures.
export interface Lines {
    buffer: WebGLBuffer;
    count: number;
}

// A layer of lines that stay from one picture to the next.
export interface Layer {
    texture: WebGLTexture;
    frame: WebGLFramebuffer;
    seen: string;
}

// A robot or a lamp on its way to another place.
export interface Dragged {
    robot: number | null;
    lamp: number | null;
    at: Place;
}

// A message to the playground's worker, and one from it.
export type ToWorker =
    | { module: ArrayBuffer; files: Texts }
    | { open: string; files?: Texts }
    | { request: Request }
    | { isTaken: true };
// Messages of the window around a frame to the page in it.
export type FromWindow =
    | { events: ShownEvent[]; sample?: ArrayBuffer }
    | { isAlive: true }
    | { isElsewhere: true }
    | { hasEnded: true };
export type FromWorker = { isReady: true } | { events: ShownEvent[]; sample?: Uint8Array };
