// SPDX-License-Identifier: Apache-2.0
import {byId, element, setHidden, setText} from "../base/dom.js";
import {RateHistory} from "./history.js";
import {formatAge, formatCount, formatRate} from "../base/format.js";

const twoLines = (first, second) => [first, element("span", {class: "under"}, second)];

const COLUMNS = [
    ["Worker", (worker) => twoLines(worker.name ?? `worker ${worker.id}`, worker.address ?? "")],
    ["State", (worker) => element("span", {class: `chip ${worker.state}`}, worker.state)],
    ["Processes", (worker) => String(worker.processes)],
    ["Tiles held", (worker) => String(worker.leases)],
    ["Rate", (worker) => formatRate(worker.rate)],
    ["Rendered", (worker) => twoLines(`${formatCount(worker.samples_done)} samples`, `${formatCount(worker.tiles_done)} tiles`)],
    ["Machine", (worker) => twoLines(worker.class ?? "–", `version ${worker.version ?? "–"}`)],
    ["Here for", (worker) => formatAge(worker.connected)],
    ["Strikes", (worker) => String(worker.strikes)],
];

/** The farm in full: figures, why work waits, and a table of workers. */
export class FarmView {
    #watch;
    #history = new RateHistory();

    constructor(watch) {
        this.#watch = watch;
        byId("farm-head").append(...COLUMNS.map(([title]) => element("th", {scope: "col"}, title)));
        watch.addEventListener("change", () => {
            if (watch.reachable)
                this.#history.add(watch.farm.rate);
            if (!byId("farm-view").hidden)
                this.#draw();
        });
    }

    set shown(shown) {
        setHidden(byId("farm-view"), !shown);
        this.#watch.wantsWorkers = shown;
    }

    #draw() {
        const {farm, workers} = this.#watch;
        if (!farm)
            return;
        setText(byId("farm-workers"), String(farm.workers));
        setText(byId("farm-processes"), String(farm.processes));
        setText(byId("farm-rate"), formatCount(farm.rate));
        setText(byId("farm-queue"), formatCount(farm.queue_depth));
        setText(byId("farm-version"), farm.version);
        this.#history.draw();
        byId("farm-why-line").classList.toggle("waiting", farm.draining || farm.why_waiting !== "");
        setText(byId("farm-why"), farm.draining ? "The service is stopping and takes no more renders."
            : farm.why_waiting || "Nothing waits.");
        byId("farm-body").replaceChildren(...workers.map((worker) => element("tr", {},
            COLUMNS.map(([title, cell]) => element("td", {"data-title": title}, cell(worker))))));
        setHidden(byId("farm-empty"), farm.workers > 0);
    }
}
