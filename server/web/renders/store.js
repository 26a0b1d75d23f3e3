// SPDX-License-Identifier: Apache-2.0
import {listRenders} from "../service/client.js";
import {isOver} from "../base/format.js";

const PAGE = 50;
const PAGE_MAX = 500;
const BUSY_MS = 1500;
const IDLE_MS = 4000;

/**
 * The renders, newest first, as far as they have been asked for. Views of a scene that is being
 * turned round (previews) are left out. "change" comes when anything differs.
 */
export class RenderStore extends EventTarget {
    renders = [];
    state = "";
    loaded = false;
    #cursor = null;
    #timer = null;
    #turn = 0;

    get hasMore() {
        return this.#cursor !== null;
    }

    find(id) {
        return this.renders.find((render) => render.id === id);
    }

    /** Only those in a state; "" for all. */
    async show(state) {
        this.state = state;
        this.renders = [];
        this.loaded = false;
        await this.refresh();
    }

    /** Asks anew for as many as are shown, and goes on doing so. */
    async refresh() {
        const turn = ++this.#turn;
        clearTimeout(this.#timer);
        try {
            const wanted = Math.min(PAGE_MAX, Math.max(PAGE, this.renders.length));
            const {renders, cursor} = await this.#fetch(wanted, null);
            if (turn !== this.#turn)
                return;
            const oldest = renders.at(-1);
            const beyond = oldest && this.renders.length > wanted
                ? this.renders.slice(this.renders.findIndex((render) => render.id === oldest.id) + 1) : [];
            this.renders = [...renders, ...beyond];
            if (beyond.length === 0)
                this.#cursor = cursor;
            this.loaded = true;
            this.#tell();
        } catch {
            // The farm's watch tells that the service is away, and has this done again.
        }
        if (turn === this.#turn && !document.hidden)
            this.#timer = setTimeout(() => this.refresh(), this.renders.some((render) => !isOver(render)) ? BUSY_MS : IDLE_MS);
    }

    /** The next page. */
    async more() {
        if (!this.hasMore)
            return;
        const turn = ++this.#turn;
        const {renders, cursor} = await this.#fetch(PAGE, this.#cursor);
        if (turn === this.#turn) {
            this.renders = [...this.renders, ...renders];
            this.#cursor = cursor;
            this.#tell();
        }
        await this.refresh();
    }

    /** What is known of one of them by other ways. */
    put(render) {
        const index = this.renders.findIndex((known) => known.id === render.id);
        if (index >= 0)
            this.renders[index] = render;
        else if (!this.state || this.state === render.state)
            this.renders = [render, ...this.renders];
        this.#tell();
    }

    drop(id) {
        this.renders = this.renders.filter((render) => render.id !== id);
        this.#tell();
    }

    /** At least one page with something to show, or the end. */
    async #fetch(count, cursor) {
        const found = [];
        do {
            const page = await listRenders({state: this.state, limit: count, cursor});
            found.push(...page.renders.filter((render) => !render.preview));
            cursor = page.next;
        } while (cursor && found.length < count / 2);
        return {renders: found, cursor};
    }

    #tell() {
        this.dispatchEvent(new Event("change"));
    }
}
