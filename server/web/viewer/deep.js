// SPDX-License-Identifier: Apache-2.0
import {setHidden} from "../base/dom.js";
import {getBitmap} from "../service/client.js";
import {isLarge, regionPath, WHOLE_PIXELS_MAX} from "../service/picture.js";

const TILE = 512;
const AT_ONCE = 4;
const KEPT_MAX = 96;

/** The tiles of an image that a viewport shows: [x, y, width, height] of each in the image. */
export function tilesInView({x, y, scale}, viewport, image, side) {
    const found = [];
    const first = (offset) => Math.max(0, Math.floor(-offset / scale / side)) * side;
    for (let top = first(y); top < Math.min(image.height, (viewport.height - y) / scale); top += side)
        for (let left = first(x); left < Math.min(image.width, (viewport.width - x) / scale); left += side)
            found.push([left, top, Math.min(side, image.width - left), Math.min(side, image.height - top)]);
    return found;
}

/**
 * The details of an image that is too large to be held as a whole: tiles of the scale that is looked
 * at, on a canvas as large as the viewport.
 */
export class DeepZoom {
    #viewport;
    #canvas;
    #zoom;
    #render = null;
    #tiles = new Map(); // by address: a bitmap, or null while it is on its way
    #wanted = [];
    #running = 0;
    #scheduled = false;

    constructor(viewport, canvas, zoom) {
        this.#viewport = viewport;
        this.#canvas = canvas;
        this.#zoom = zoom;
        zoom.addEventListener("change", () => this.#schedule());
    }

    /** Of a render that is over; null for none. */
    show(render) {
        if (render?.id !== this.#render?.id)
            this.#tiles.clear();
        this.#render = render && isLarge(render) ? render : null;
        setHidden(this.#canvas, true);
        this.#schedule();
    }

    #schedule() {
        if (this.#scheduled || !this.#render)
            return;
        this.#scheduled = true;
        requestAnimationFrame(() => {
            this.#scheduled = false;
            if (this.#render)
                this.#draw();
        });
    }

    #draw() {
        const {width, height} = this.#render;
        const pixels = this.#zoom.scale * devicePixelRatio; // of the screen, for one of the image
        const isNear = pixels > Math.sqrt(WHOLE_PIXELS_MAX / (width * height));
        setHidden(this.#canvas, !isNear);
        if (!isNear)
            return;
        const factor = Math.max(1, 2 ** Math.floor(-Math.log2(pixels)));
        const view = {width: this.#viewport.clientWidth, height: this.#viewport.clientHeight};
        this.#canvas.width = view.width * devicePixelRatio;
        this.#canvas.height = view.height * devicePixelRatio;
        const context = this.#canvas.getContext("2d");
        context.imageSmoothingEnabled = pixels <= 2;
        context.setTransform(pixels, 0, 0, pixels, this.#zoom.x * devicePixelRatio, this.#zoom.y * devicePixelRatio);
        this.#wanted = [];
        for (const tile of tilesInView(this.#zoom, view, this.#render, TILE * factor)) {
            const path = regionPath(this.#render, tile, factor);
            const bitmap = this.#tiles.get(path);
            if (bitmap)
                context.drawImage(bitmap, ...tile);
            else if (bitmap === undefined)
                this.#wanted.push(path);
        }
        this.#fetch();
    }

    #fetch() {
        while (this.#running < AT_ONCE && this.#wanted.length > 0)
            void this.#load(this.#wanted.shift());
    }

    async #load(path) {
        this.#running++;
        this.#tiles.set(path, null);
        try {
            this.#tiles.set(path, (await getBitmap(path)).bitmap);
            for (const oldest of [...this.#tiles.keys()].slice(0, Math.max(0, this.#tiles.size - KEPT_MAX)))
                this.#tiles.delete(oldest);
        } catch {
            this.#tiles.delete(path); // asked for again when the view moves
        }
        this.#running--;
        this.#fetch();
        this.#schedule();
    }
}
