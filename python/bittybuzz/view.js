// The page of a session in a frame of the notebook. It has no address and no rights of the notebook's own page: messages alone pass
// between it, this script and the kernel.

/**
 * A message of the kernel: the page (compressed, in the buffer), a batch of events, or a state of the session (bbz/page/frame/session.js).
 * @typedef {{ view: number, page?: true, events?: string, isAlive?: true, isElsewhere?: true, hasEnded?: true }} FromKernel
 */

// Rights of the frame: a sandbox has no others.
const RIGHTS = ["allow-scripts", "allow-downloads", "allow-modals"];

/** @param {{ model: any, el: HTMLElement }} shown */
function render({ model, el }) {
    // The number by which the kernel knows this frame among others of the same session.
    const view = Math.floor(Math.random() * Number.MAX_SAFE_INTEGER);
    const frame = document.createElement("iframe");
    frame.sandbox.add(...RIGHTS);
    frame.title = "BittyBuzz";
    const size = () => {
        frame.style.cssText = `width: 100%; height: ${model.get("height")}px; border: 0`;
    };
    size();
    /** @type {(message: FromKernel, buffers: DataView[]) => Promise<void>} */
    const fromKernel = async ({ view: receiver, ...message }, [buffer]) => {
        if (receiver !== view) {
            return;
        }
        const bytes = buffer && new Uint8Array(buffer.buffer, buffer.byteOffset, buffer.byteLength).slice();
        if (message.page) {
            frame.srcdoc = await new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
        } else if (message.events) {
            frame.contentWindow?.postMessage({ events: JSON.parse(message.events), sample: bytes?.buffer }, "*");
        } else {
            frame.contentWindow?.postMessage(message, "*");
        }
    };
    const fromPage = (/** @type {MessageEvent} */ { data, source }) => {
        if (source === frame.contentWindow && typeof data === "string") {
            model.send({ view, text: data });
        }
    };
    model.on("change:height", size);
    model.on("msg:custom", fromKernel);
    window.addEventListener("message", fromPage);
    el.append(frame);
    model.send({ view, text: "page" });
    return () => {
        model.off("change:height", size);
        model.off("msg:custom", fromKernel);
        window.removeEventListener("message", fromPage);
        model.send({ view, text: "close" });
    };
}

export default { render };
