// SPDX-License-Identifier: Apache-2.0
// The farm as it is now, asked for again and again; also how the page knows that the service is there.

import {getFarm, getWorkers} from "./client.js";

const EVERY_MS = 2000;

export class FarmWatch extends EventTarget {
    farm = null;
    workers = [];
    reachable = true;
    #wantsWorkers = false;
    #timer = null;

    /** Begins to ask; "change" comes after every answer, "back" when the service is there again. */
    start() {
        document.addEventListener("visibilitychange", () => this.#soon());
        void this.#ask();
    }

    /** Whether anybody looks at the workers one by one. */
    set wantsWorkers(wanted) {
        this.#wantsWorkers = wanted;
        if (wanted)
            this.#soon();
    }

    #soon() {
        clearTimeout(this.#timer);
        if (!document.hidden)
            void this.#ask();
    }

    async #ask() {
        const was = this.reachable;
        try {
            [this.farm, this.workers] = await Promise.all([getFarm(), this.#wantsWorkers ? getWorkers() : []]);
            this.reachable = true;
        } catch (refusal) {
            this.reachable = this.farm !== null && refusal.status !== undefined;
        }
        clearTimeout(this.#timer);
        if (!document.hidden)
            this.#timer = setTimeout(() => this.#ask(), this.reachable ? EVERY_MS : EVERY_MS / 2);
        this.dispatchEvent(new Event("change"));
        if (this.reachable && !was)
            this.dispatchEvent(new Event("back"));
    }
}
