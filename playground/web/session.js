// The connection to the session: a worker of this page runs it. Examples are chosen in the header.

import { element, part } from "./element.js";
import { texts } from "./texts.js";

const FIRST = "examples/swarm/gradient.toml";

export function connect({ onEvent, onSample, onEnd }) {
    const worker = new Worker(new URL("worker.js", import.meta.url), { type: "module" });
    const open = (scenario) => worker.postMessage({ open: scenario });
    const select = element("select", { id: "example", "aria-label": texts.example, title: texts.example });
    select.onchange = () => {
        location.hash = select.value;
    };
    part("controls").before(select);
    const names = () => [...select.options].map(({ value }) => value);
    const show = () => {
        const wanted = decodeURIComponent(location.hash.slice(1));
        select.value = names().includes(wanted) ? wanted : FIRST;
        open(select.value);
    };
    addEventListener("hashchange", show);
    worker.onmessage = ({ data }) => {
        if (data.scenarios) {
            select.append(...data.scenarios.map(({ path, title }) => new Option(title, path)));
            show();
        } else if (data.sample) {
            onSample(data.sample);
            worker.postMessage({ isSampled: true });
        } else {
            onEvent(data.event);
        }
    };
    worker.onerror = () => onEnd(texts.broken);
    return {
        ask(request) {
            worker.postMessage({ request });
        },
    };
}
