// SPDX-License-Identifier: Apache-2.0
import {byId, setHidden} from "../base/dom.js";

const STEP = 2;

/** A second image over the first, right of a line that can be dragged. */
export class Compare {
    #canvas = byId("other");
    #handle = byId("compare-handle");
    #sheet;
    #at = 50;

    constructor(sheet) {
        this.#sheet = sheet;
        this.#handle.addEventListener("pointerdown", (event) => this.#grab(event));
        this.#handle.addEventListener("pointermove", (event) => this.#drag(event));
        this.#handle.addEventListener("keydown", (event) => this.#key(event));
        this.hide();
    }

    show(bitmap, name) {
        this.#canvas.width = bitmap.width;
        this.#canvas.height = bitmap.height;
        this.#canvas.getContext("2d").drawImage(bitmap, 0, 0);
        this.#handle.setAttribute("aria-label", `Line between this render and ${name}`);
        setHidden(this.#canvas, false);
        setHidden(this.#handle, false);
        this.#move(this.#at);
    }

    hide() {
        setHidden(this.#canvas, true);
        setHidden(this.#handle, true);
    }

    #move(percent) {
        this.#at = Math.min(100, Math.max(0, percent));
        this.#canvas.style.clipPath = `inset(0 0 0 ${this.#at}%)`;
        this.#handle.style.left = `${this.#at}%`;
        this.#handle.setAttribute("aria-valuenow", String(Math.round(this.#at)));
    }

    #grab(event) {
        event.stopPropagation();
        this.#handle.setPointerCapture(event.pointerId);
    }

    #drag(event) {
        if (!this.#handle.hasPointerCapture(event.pointerId))
            return;
        const box = this.#sheet.getBoundingClientRect();
        event.stopPropagation();
        this.#move(100 * (event.clientX - box.left) / box.width);
    }

    #key(event) {
        const by = {ArrowLeft: -STEP, ArrowRight: STEP, Home: -100, End: 100}[event.key];
        if (by !== undefined) {
            event.preventDefault();
            event.stopPropagation();
            this.#move(this.#at + by);
        }
    }
}
