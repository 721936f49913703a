// The connection to the session: a WebSocket of the page's server.

import { texts } from "./texts.js";

/**
 * @import { Connection, Receiver } from "./page"
 */

/**
 * @param {Receiver} receiver
 * @returns {Connection}
 */
export function connect({ onEvent, onSample, onEnd }) {
    const url = new URL("socket", location.href);
    url.protocol = "ws:";
    const socket = new WebSocket(url);
    socket.binaryType = "arraybuffer";
    socket.onmessage = ({ data }) => {
        if (typeof data === "string") {
            onEvent(JSON.parse(data));
        } else {
            onSample(new Uint8Array(data));
        }
    };
    /** @param {Parameters<Connection["ask"]>[0]} request */
    const send = (request) => socket.send(JSON.stringify(request));
    // What was asked for while the connection was made.
    /** @type {Parameters<typeof send>[0][]} */
    const early = [];
    socket.onopen = () => early.forEach(send);
    socket.onclose = () => onEnd(texts.away);
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
