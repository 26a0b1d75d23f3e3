// SPDX-License-Identifier: Apache-2.0

const WINDOW_MS = 4000;

/** How fast a count rises, over the last seconds. */
export class Rate {
    #marks = [];

    add(count, now = performance.now()) {
        this.#marks.push({count, now});
        while (this.#marks.length > 2 && this.#marks[1].now < now - WINDOW_MS)
            this.#marks.shift();
    }

    get perSecond() {
        const first = this.#marks[0], last = this.#marks.at(-1);
        const seconds = (last.now - first.now) / 1000;
        return seconds > 0 ? Math.max(0, last.count - first.count) / seconds : 0;
    }
}
