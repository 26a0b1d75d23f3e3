// SPDX-License-Identifier: Apache-2.0
import {WHOLE_PIXELS_MAX} from "../service/picture.js";

const GLOW_MS = 700;

/**
 * The canvas that holds the image as far as it is known, and one above it where tiles that have just
 * come glow. Of very large images it is smaller than they are.
 */
export class Stage {
    #canvas;
    #glow;
    #scale = 1;
    #size = {width: 1, height: 1};
    #tiles = [];
    #marks = [];
    #calm = matchMedia("(prefers-reduced-motion: reduce)");

    constructor(canvas, glow) {
        this.#canvas = canvas;
        this.#glow = glow;
    }

    /** Begins with nothing, for an image of this size. */
    clear(width, height) {
        this.#scale = Math.min(1, Math.sqrt(WHOLE_PIXELS_MAX / (width * height)));
        for (const canvas of [this.#canvas, this.#glow]) {
            canvas.width = Math.max(1, Math.round(width * this.#scale));
            canvas.height = Math.max(1, Math.round(height * this.#scale));
        }
        this.#tiles = [];
        this.#marks = [];
        this.#size = {width, height};
    }

    /** The whole image, whatever the bitmap's own size. */
    draw(bitmap) {
        const context = this.#canvas.getContext("2d");
        context.imageSmoothingQuality = "high";
        context.drawImage(bitmap, 0, 0, this.#canvas.width, this.#canvas.height);
    }

    /** Only these rectangles, [x, y, width, height] of the image, of a bitmap of the whole. */
    drawTiles(bitmap, tiles) {
        const context = this.#canvas.getContext("2d");
        const place = ([x, y, width, height], to) => {
            const sx = to.width / this.#size.width, sy = to.height / this.#size.height;
            return [x * sx, y * sy, width * sx, height * sy];
        };
        for (const tile of tiles)
            context.drawImage(bitmap, ...place(tile, bitmap), ...place(tile, this.#canvas));
    }

    /** Shows that these rectangles have just come. */
    glow(tiles) {
        if (this.#calm.matches)
            return;
        const until = performance.now() + GLOW_MS;
        if (this.#tiles.length === 0)
            requestAnimationFrame(() => this.#drawGlow());
        this.#tiles.push(...tiles.map((tile) => ({tile, until})));
    }

    /** Outlines rectangles, {tile, color, label}, until others are marked. */
    mark(marks) {
        this.#marks = marks;
        if (this.#tiles.length === 0)
            requestAnimationFrame(() => this.#drawGlow());
    }

    /** Just inside the rectangle, light on dark, so that it is seen on every image. */
    #drawMarks(context) {
        const width = Math.max(1, this.#glow.width / 480), size = 7 * width;
        context.font = `${size}px sans-serif`;
        for (const {tile, color, label} of this.#marks) {
            const [x, y, w, h] = tile.map((value) => value * this.#scale);
            for (const [style, line] of [["#000a", 3 * width], [color, width]]) {
                context.strokeStyle = style;
                context.lineWidth = line;
                context.strokeRect(x + 1.5 * width, y + 1.5 * width, w - 3 * width, h - 3 * width);
            }
            if (h < 2 * size || context.measureText(label).width > w - 2 * size)
                continue;
            context.strokeStyle = "#000a";
            context.lineWidth = 2 * width;
            context.strokeText(label, x + size / 2 + width, y + 1.4 * size);
            context.fillStyle = color;
            context.fillText(label, x + size / 2 + width, y + 1.4 * size);
        }
    }

    #drawGlow() {
        const context = this.#glow.getContext("2d");
        const now = performance.now();
        context.clearRect(0, 0, this.#glow.width, this.#glow.height);
        this.#drawMarks(context);
        this.#tiles = this.#tiles.filter(({until}) => until > now);
        context.strokeStyle = getComputedStyle(this.#glow).color;
        context.lineWidth = Math.max(1, this.#glow.width / 640);
        for (const {tile: [x, y, width, height], until} of this.#tiles) {
            context.globalAlpha = (until - now) / GLOW_MS;
            context.strokeRect(x * this.#scale + 0.5, y * this.#scale + 0.5, width * this.#scale - 1, height * this.#scale - 1);
        }
        context.globalAlpha = 1;
        if (this.#tiles.length > 0)
            requestAnimationFrame(() => this.#drawGlow());
    }
}
