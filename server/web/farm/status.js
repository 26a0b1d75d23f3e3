// SPDX-License-Identifier: Apache-2.0
import {byId, setHidden, setText} from "../base/dom.js";
import {announce} from "../base/announce.js";
import {formatRate} from "../base/format.js";

/** The farm in a word, in the bar on top; and a line when the service is away. */
export function showStatus(watch) {
    const pill = byId("farm-pill");

    watch.addEventListener("change", () => {
        const {farm, reachable} = watch;
        if (!reachable && byId("offline").hidden)
            announce("The service does not answer. Trying again.");
        setHidden(byId("offline"), reachable);
        pill.dataset.state = !reachable ? "away" : farm.draining ? "draining" : farm.workers === 0 ? "empty" : "ready";
        setText(byId("farm-text"), !reachable ? "no connection"
            : farm.workers === 0 ? "no workers"
                : `${farm.workers} worker${farm.workers === 1 ? "" : "s"} · ${farm.rate > 0 ? formatRate(farm.rate) : "idle"}`);
        setText(byId("why-waiting"), farm?.why_waiting ?? "");
    });
    watch.addEventListener("back", () => announce("The service is there again."));
}
