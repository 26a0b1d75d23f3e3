// SPDX-License-Identifier: Apache-2.0

const SCALE_MAX = 64;
const WHEEL_STEP = 0.0015;
const KEY_PAN = 60;
const MARGIN = 64;

/**
 * Where the sheet (the image in its own pixels) lies in the viewport: moved and scaled by pointer,
 * wheel and keys. While it fits it stays fitted when the window changes.
 */
export class Zoom extends EventTarget {
    scale = 1;
    x = 0;
    y = 0;
    #viewport;
    #sheet;
    #width = 1;
    #height = 1;
    #fitted = true;

    constructor(viewport, sheet) {
        super();
        this.#viewport = viewport;
        this.#sheet = sheet;
        new ResizeObserver(() => this.#fitted && this.fit()).observe(viewport);
    }

    setSize(width, height) {
        if (width === this.#width && height === this.#height)
            return;
        this.#width = width;
        this.#height = height;
        this.#sheet.style.width = `${width}px`;
        this.#sheet.style.height = `${height}px`;
        this.fit();
    }

    fit() {
        const {clientWidth, clientHeight} = this.#viewport;
        this.scale = Math.max(0.01, Math.min((clientWidth - MARGIN) / this.#width, (clientHeight - MARGIN) / this.#height));
        this.#centre();
        this.#fitted = true;
        this.#apply();
    }

    /** One pixel of the image for one of the screen. */
    actual() {
        const {clientWidth, clientHeight} = this.#viewport;
        this.zoomAt(clientWidth / 2, clientHeight / 2, 1 / devicePixelRatio / this.scale);
    }

    /** Zooms by a factor about a point of the viewport. */
    zoomAt(x, y, factor) {
        const scale = Math.min(SCALE_MAX, Math.max(0.02, this.scale * factor));
        this.x = x - (x - this.x) * scale / this.scale;
        this.y = y - (y - this.y) * scale / this.scale;
        this.scale = scale;
        this.#fitted = false;
        this.#apply();
    }

    pan(x, y) {
        this.x += x;
        this.y += y;
        this.#fitted = false;
        this.#apply();
    }

    wheel(event) {
        const box = this.#viewport.getBoundingClientRect();
        this.zoomAt(event.clientX - box.left, event.clientY - box.top, Math.exp(-event.deltaY * WHEEL_STEP));
    }

    /** True when the key was one of these. */
    key(event) {
        const {clientWidth, clientHeight} = this.#viewport;
        const about = (factor) => this.zoomAt(clientWidth / 2, clientHeight / 2, factor);
        const action = {
            ArrowLeft: () => this.pan(KEY_PAN, 0), ArrowRight: () => this.pan(-KEY_PAN, 0),
            ArrowUp: () => this.pan(0, KEY_PAN), ArrowDown: () => this.pan(0, -KEY_PAN),
            "+": () => about(1.25), "=": () => about(1.25), "-": () => about(0.8),
            0: () => this.fit(), 1: () => this.actual(),
        }[event.key];
        action?.();
        return action !== undefined;
    }

    /** The point of the image under one of the screen, in parts of its width and height. */
    toImage(clientX, clientY) {
        const box = this.#viewport.getBoundingClientRect();
        return [(clientX - box.left - this.x) / this.scale / this.#width, (clientY - box.top - this.y) / this.scale / this.#height];
    }

    #centre() {
        this.x = (this.#viewport.clientWidth - this.#width * this.scale) / 2;
        this.y = (this.#viewport.clientHeight - this.#height * this.scale) / 2;
    }

    #apply() {
        this.#sheet.style.transform = `translate(${this.x}px, ${this.y}px) scale(${this.scale})`;
        this.#sheet.classList.toggle("magnified", this.scale * devicePixelRatio > 2);
        this.dispatchEvent(new Event("change"));
    }
}
