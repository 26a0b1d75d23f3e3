// SPDX-License-Identifier: Apache-2.0

/**
 * Runs work for the newest of the values that come, one at a time: what comes while it runs waits,
 * and only the last of that is kept. pace: so many times as long as the work took it rests.
 */
export class Latest {
    #work;
    #pace;
    #running = false;
    #waiting = null;

    constructor(work, pace = 0) {
        this.#work = work;
        this.#pace = pace;
    }

    push(value) {
        this.#waiting = {value};
        if (!this.#running)
            void this.#run();
    }

    /** Forgets what waits. */
    clear() {
        this.#waiting = null;
    }

    async #run() {
        this.#running = true;
        while (this.#waiting) {
            const {value} = this.#waiting;
            const start = performance.now();
            this.#waiting = null;
            await this.#work(value);
            if (this.#pace > 0)
                await new Promise((done) => setTimeout(done, this.#pace * (performance.now() - start)));
        }
        this.#running = false;
    }
}
