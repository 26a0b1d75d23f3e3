// SPDX-License-Identifier: Apache-2.0
import {Latest} from "../base/latest.js";
import {follow} from "../service/events.js";
import {getBitmap, renderPath} from "../service/client.js";

const PACE = 2; // fetching takes at most a third of the time: encoding takes from rendering

/**
 * Brings a render onto the stage while it is being rendered: the tiles that the events tell are cut
 * out of its image, whose path is given, and glow unless it is calm. "held", "progress" and "done" come with what the events say in detail.
 */
export class Live extends EventTarget {
    #path;
    #stage;
    #tiles = [];
    #fetches = new Latest(() => this.#fetch(), PACE);
    #stop;
    #ending = new AbortController();
    #calm;

    constructor(id, path, stage, calm = false) {
        super();
        this.#path = path;
        this.#stage = stage;
        this.#calm = calm;
        this.#stop = follow(`${renderPath(id)}/events`, {
            onTiles: ({tiles}) => this.#take(tiles),
            onHeld: ({workers}) => this.#tell("held", workers),
            onProgress: (progress) => this.#tell("progress", progress),
            onDone: (render) => this.#finish(render),
        });
    }

    /** Aborted when it is closed. */
    get signal() {
        return this.#ending.signal;
    }

    close() {
        this.#ending.abort(); // what is fetched may be removed next
        this.#stop();
    }

    #take(tiles) {
        this.#tiles.push(...tiles);
        this.#fetches.push(null);
    }

    async #fetch() {
        const tiles = this.#tiles;
        this.#tiles = [];
        if (this.signal.aborted)
            return;
        try {
            const {bitmap} = await getBitmap(this.#path, this.signal);
            if (!this.signal.aborted) {
                this.#stage.drawTiles(bitmap, tiles);
                if (!this.#calm)
                    this.#stage.glow(tiles);
                this.#tell("drawn", null);
            }
        } catch {
            this.#tiles.unshift(...tiles); // with the next ones, or when it is done
        }
    }

    #finish(render) {
        this.#fetches.clear();
        if (!this.signal.aborted)
            this.#tell("done", render);
    }

    #tell(name, detail) {
        this.dispatchEvent(new CustomEvent(name, {detail}));
    }
}
