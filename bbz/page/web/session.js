// The connection to the session: a WebSocket of the page's server.

import { texts } from "./texts.js";

/**
 * @import { Connection, Receiver } from "./page"
 */

// Messages of the server that are no events, and answers to them (bbz/page/src/server.rs).
const [WAIT, TAKE_OVER, PING, TAKEN] = ["wait", "take over", "ping", "taken"];

// Milliseconds between two questions whether the session handles requests, and until an answer is late.
const [PAUSE, LATE] = [1000, 3000];

/**
 * @param {Receiver} receiver
 * @returns {Connection}
 */
export function connect({ onEvent, onSample, onEnd, onWait, onLate }) {
    const url = new URL("socket", location.href);
    url.protocol = "ws:";
    const socket = new WebSocket(url);
    socket.binaryType = "arraybuffer";
    // When the question was sent that has no answer yet.
    /** @type {number | null} */
    let asked = null;
    // Takes a part of a batch. The next batch comes after the last part, also if a mistake of the page stops it here.
    const take = (/** @type {() => void} */ show, /** @type {boolean} */ isLast) => {
        try {
            show();
        } finally {
            if (isLast && socket.readyState === WebSocket.OPEN) {
                socket.send(TAKEN);
            }
        }
    };
    socket.onmessage = ({ data }) => {
        if (data === PING) {
            asked = null;
            onLate(null);
        } else if (data === WAIT) {
            onWait(() => socket.readyState === WebSocket.OPEN && socket.send(TAKE_OVER));
        } else if (typeof data === "string") {
            const { events, has_sample } = JSON.parse(data);
            take(() => events.forEach(onEvent), !has_sample);
        } else {
            take(() => onSample(new Uint8Array(data)), true);
        }
    };
    /** @param {Parameters<Connection["ask"]>[0]} request */
    const send = (request) => socket.send(JSON.stringify(request));
    // What was asked for while the connection was made.
    /** @type {Parameters<typeof send>[0][]} */
    const early = [];
    const timer = setInterval(() => {
        if (socket.readyState !== WebSocket.OPEN) {
            return;
        }
        if (asked === null) {
            asked = performance.now();
            socket.send(PING);
        } else if (performance.now() - asked > LATE) {
            onLate((performance.now() - asked) / 1000);
        }
    }, PAUSE);
    socket.onopen = () => early.forEach(send);
    socket.onclose = () => {
        clearInterval(timer);
        onEnd(texts.away);
    };
    return {
        ask(request) {
            if (socket.readyState === WebSocket.CONNECTING) {
                early.push(request);
            } else if (socket.readyState === WebSocket.OPEN) {
                send(request);
            }
        },
    };
}
