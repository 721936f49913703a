// The connection to the session of a page in a frame, such as that of a notebook: the window around it passes messages on.
//
// The frame has no address and may be in a sandbox, so it knows its window by the source of a message alone.

import { texts } from "./texts.js";

/**
 * @import { Connection, FromWindow, Receiver } from "./page"
 */

// Messages to the window that are no requests. The window sends `PING` back once the session has handled what came before it.
const [BEGIN, TAKE_OVER, PING, TAKEN] = ["begin", "take over", "ping", "taken"];

// Milliseconds between two questions whether the session handles requests, and until an answer is late.
const [PAUSE, LATE] = [1000, 3000];

/**
 * @param {Receiver} receiver
 * @returns {Connection}
 */
export function connect({ onEvent, onSample, onEnd, onWait, onLate }) {
    const send = (/** @type {string} */ text) => parent.postMessage(text, "*");
    // When the question was sent that has no answer yet.
    /** @type {number | null} */
    let asked = null;
    // A page that is loaded again first gets what was on its way to the one before.
    let hasBegun = false;
    let hasEnded = false;
    const timer = setInterval(() => {
        if (asked === null) {
            asked = performance.now();
            send(PING);
        } else if (performance.now() - asked > LATE) {
            onLate((performance.now() - asked) / 1000);
        }
    }, PAUSE);
    addEventListener("message", (/** @type {MessageEvent<FromWindow>} */ { data, source }) => {
        if (source !== parent || hasEnded) {
            return;
        }
        if ("isAlive" in data) {
            asked = null;
            onLate(null);
        } else if ("isElsewhere" in data) {
            onWait(() => send(TAKE_OVER));
        } else if ("hasEnded" in data) {
            hasEnded = true;
            clearInterval(timer);
            onEnd(texts.awayFromNotebook);
        } else if (hasBegun || data.events.some(({ event }) => event === "begin")) {
            hasBegun = true;
            // The next batch comes after this one, also if a mistake of the page stops it here.
            try {
                data.events.forEach(onEvent);
                if (data.sample) {
                    onSample(new Uint8Array(data.sample));
                }
            } finally {
                send(TAKEN);
            }
        }
    });
    send(BEGIN);
    return {
        ask(request) {
            if (!hasEnded) {
                send(JSON.stringify(request));
            }
        },
    };
}
