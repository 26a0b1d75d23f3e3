// SPDX-License-Identifier: Apache-2.0
import {byId, element, setHidden} from "../base/dom.js";

const GOLDEN_ANGLE = 137.5; // neighbours in it look least alike

/** The same for a worker as long as it is connected. */
function colorOf(worker) {
    return `hsl(${Number(worker.id) * GOLDEN_ANGLE % 360} 90% 65%)`;
}

function nameOf(worker) {
    return worker.name ?? `worker ${worker.id}`;
}

/** The page's policy allows a style that a script sets, and no attribute. */
function swatch(worker) {
    const node = element("span", {class: "swatch", "aria-hidden": "true"});
    node.style.background = colorOf(worker);
    return node;
}

/** Which worker is at work on which tiles: outlined on the stage, and in words beside it. */
export class Holders {
    #stage;
    #workers = [];
    #shown = byId("holders-shown");

    constructor(stage) {
        this.#stage = stage;
        this.#shown.addEventListener("change", () => this.#mark());
    }

    /** As the event "held" tells them. */
    show(workers) {
        this.#workers = workers;
        setHidden(byId("holders-panel"), workers.length === 0);
        byId("holders").replaceChildren(...workers.map((worker) => element("li", {}, swatch(worker),
            element("span", {}, nameOf(worker)),
            element("span", {class: "quiet"}, worker.tiles.length === 1 ? "1 tile" : `${worker.tiles.length} tiles`))));
        this.#mark();
    }

    #mark() {
        this.#stage.mark(!this.#shown.checked ? [] : this.#workers.flatMap((worker) => worker.tiles.map(
            ([, ...tile]) => ({tile, color: colorOf(worker), label: nameOf(worker)}))));
    }
}
