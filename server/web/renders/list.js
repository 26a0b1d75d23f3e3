// SPDX-License-Identifier: Apache-2.0
import {byId, setHidden, setText} from "../base/dom.js";
import {RenderRow} from "./row.js";

/** Shows the store's renders beside the viewer, and asks it for more when the end comes in sight. */
export class RenderList {
    #store;
    #rows = new Map();
    #list = byId("render-list");
    #current = null;

    constructor(store) {
        this.#store = store;
        store.addEventListener("change", () => this.#draw());
        byId("state-filter").addEventListener("change", (event) => store.show(event.target.value));
        byId("more").addEventListener("click", () => store.more());
        new IntersectionObserver(([seen]) => seen.isIntersecting && store.more(), {root: byId("list-scroll"), rootMargin: "400px"})
            .observe(byId("more"));
        this.#list.addEventListener("keydown", (event) => this.#step(event));
    }

    set current(id) {
        this.#current = id;
        this.#draw();
    }

    #draw() {
        const wanted = new Set();
        let place = this.#list.firstElementChild;
        for (const render of this.#store.renders) {
            wanted.add(render.id);
            const row = this.#rows.get(render.id) ?? this.#add(render);
            row.update(render, render.id === this.#current);
            if (row.node === place)
                place = place.nextElementSibling;
            else
                this.#list.insertBefore(row.node, place);
        }
        for (const [id, row] of this.#rows) {
            if (!wanted.has(id)) {
                row.node.remove();
                this.#rows.delete(id);
            }
        }
        setHidden(byId("more"), !this.#store.hasMore);
        setHidden(byId("no-renders"), !this.#store.loaded || wanted.size > 0);
        setText(byId("render-count"), wanted.size === 0 ? "" : `${wanted.size}${this.#store.hasMore ? "+" : ""}`);
    }

    #add(render) {
        const row = new RenderRow(render);
        this.#rows.set(render.id, row);
        return row;
    }

    /** Up and down go from row to row. */
    #step(event) {
        const next = {ArrowDown: "nextElementSibling", ArrowUp: "previousElementSibling"}[event.key];
        const to = next && event.target.closest("li")?.[next];
        if (to) {
            event.preventDefault();
            to.querySelector("a").focus();
        }
    }
}
