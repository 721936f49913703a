// The connection to the session: a worker of this page runs it. Examples are chosen in the header.
//
// The address names the scenario behind `#`, and may have scripts in the place of the example's: `#examples/patrol.toml&examples/patrol.bzz=…`,
// compressed and in the letters of addresses.

import { element, option, part } from "./element.js";
import { exportPage, inlined, MODULE } from "./export.js";
import { LinkTooLong, pack, unpack } from "./link.js";
import { texts } from "./texts.js";
import { XzReadableStream } from "./unpack.js";
import { UnsavedTexts } from "./unsaved.js";

const FIRST = "examples/swarm/gradient.toml";

/**
 * @import { BeginEvent } from "./events"
 * @import { Connection, FromWorker, Receiver, Texts, ToWorker } from "./page"
 */

/**
 * @param {Receiver} receiver
 * @returns {Connection}
 */
export function connect({ onEvent, onSample, onEnd }) {
    const select = element("select", { id: "example", "aria-label": texts.example, title: texts.example });
    select.onchange = () => {
        location.hash = select.value;
    };
    part("controls").before(select);
    /** @type {Worker | null} */
    let worker = null;
    /** @type {(message: ToWorker, transferred?: Transferable[]) => void} */
    const send = (message, transferred = []) => worker?.postMessage(message, transferred);
    // Scripts of the address.
    /** @type {Texts} */
    let own = {};
    // The files of the examples.
    /** @type {Texts} */
    let examples = {};
    const unsaved = new UnsavedTexts();
    // The path of a file whose name is relative to the folder of the scenario.
    const fileOf = (/** @type {string} */ name) => select.value.replace(/[^/]*$/, "") + name;
    const savedOf = (/** @type {string} */ file) => own[file] ?? examples[file] ?? "";
    // A browser may forbid its storage, or have no room. The page says so once, and asks before it is left.
    let isStorageBroken = false;
    /** @type {<T>(act: () => T, otherwise: T) => T} */
    const stored = (act, otherwise) => {
        try {
            return act();
        } catch (error) {
            if (!isStorageBroken) {
                isStorageBroken = true;
                onEvent({ event: "refused", text: texts.noStorage(String(error)), help: null });
            }
            return otherwise;
        }
    };
    // A begin with the texts that were typed earlier.
    const offering = (/** @type {{ event: "begin" } & BeginEvent} */ event) => {
        const { scripts } = event;
        if (!scripts) {
            return event;
        }
        const names = [...scripts.names, scripts.scenario];
        const offers = stored(() => names.flatMap((name) => unsaved.offers(fileOf(name), name, savedOf(fileOf(name)))), []);
        return { ...event, scripts: { ...scripts, unsaved: offers } };
    };
    /** @type {(request: Parameters<Connection["ask"]>[0]) => void} */
    const carryOut = (request) => {
        if (typeof request === "object" && "unsaved" in request) {
            const { name, text } = request.unsaved;
            stored(() => unsaved.keep(fileOf(name), savedOf(fileOf(name)), text), undefined);
        } else if (typeof request === "object" && "discard" in request) {
            const { id } = request.discard;
            stored(() => unsaved.discard(id), undefined);
        } else {
            send({ request });
        }
    };
    // What was asked for while the module was loaded.
    /** @type {Parameters<Connection["ask"]>[0][] | null} */
    let early = [];
    const show = async () => {
        const [wanted, ...scripts] = location.hash.slice(1).split("&");
        const path = decodeURIComponent(wanted);
        select.value = [...select.options].some(({ value }) => value === path) ? path : FIRST;
        try {
            own = await unpack(scripts);
        } catch (error) {
            own = {};
            onEvent({ event: "failed", text: error instanceof LinkTooLong ? texts.longAddress(error.path) : texts.badAddress });
            return;
        }
        send({ open: select.value, files: own });
        early?.forEach(carryOut);
        early = null;
    };
    const begin = async () => {
        const [program, module, list] = await Promise.all(["worker.js", MODULE, "examples.json"].map(file));
        const { scenarios, files, version } = JSON.parse(new TextDecoder().decode(list));
        examples = files;
        select.append(...scenarios.map((/** @type {{ path: string, title: string }} */ { path, title }) => option(title, path)));
        worker = new Worker(URL.createObjectURL(new Blob([program], { type: "text/javascript" })));
        worker.onmessage = (/** @type {MessageEvent<FromWorker>} */ { data }) => {
            if ("isReady" in data) {
                addEventListener("hashchange", show);
                show();
            } else {
                try {
                    data.events.forEach((event) => onEvent(event.event === "begin" ? offering(event) : event));
                    if (data.sample) {
                        onSample(data.sample);
                    }
                } finally {
                    send({ isTaken: true });
                }
            }
        };
        // A broken invariant traps in the module, which has neither texts nor places of its source.
        worker.onerror = ({ message }) => {
            worker?.terminate();
            onEvent({ event: "defect", text: texts.moduleDefect(version, message), help: texts.moduleAdvice });
        };
        send({ module, files }, [module]);
    };
    begin().catch(() => onEnd(texts.broken));
    const changed = (/** @type {Texts} */ scripts) => ({ ...own, ...scripts });
    return {
        ask(request) {
            if (early) {
                early.push(request);
            } else {
                carryOut(request);
            }
        },
        // Returns the address of this page with scripts, given as an object of files and texts.
        async link(scripts) {
            const packed = await Promise.all(Object.entries(changed(scripts)).map(async ([path, text]) => `&${encodeURIComponent(path)}=${await pack(text)}`));
            return new URL(`#${select.value}${packed.join("")}`, location.href).href;
        },
        // Returns this page with the scenario and these scripts as one file.
        exportPage: (scripts) => exportPage(select.value, changed(scripts)),
    };
}

/** @param {string} name */
async function file(name) {
    const answer = inlined(name) ?? (await fetch(new URL(name, import.meta.url)));
    if (name === MODULE && answer.ok && answer.body) {
        return new Response(new XzReadableStream(answer.body)).arrayBuffer();
    }
    return answer.arrayBuffer();
}
