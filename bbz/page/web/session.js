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
    socket.onclose = () => onEnd(texts.away);
    return {
        ask(request) {
            if (socket.readyState === WebSocket.OPEN) {
                socket.send(JSON.stringify(request));
            }
        },
    };
}
