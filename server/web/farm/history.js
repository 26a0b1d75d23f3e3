// SPDX-License-Identifier: Apache-2.0
import {byId} from "../base/dom.js";

const POINTS = 120;
const WIDTH = 600;
const HEIGHT = 90;
const HEADROOM = 1.15;

/** A curve of the farm's rate over the last answers. */
export class RateHistory {
    #rates = [];
    #area = document.createElementNS("http://www.w3.org/2000/svg", "path");
    #line = document.createElementNS("http://www.w3.org/2000/svg", "path");

    constructor() {
        this.#area.setAttribute("class", "history-area");
        this.#line.setAttribute("class", "history-line");
        byId("farm-history").append(this.#area, this.#line);
    }

    add(rate) {
        this.#rates.push(rate);
        if (this.#rates.length > POINTS)
            this.#rates.shift();
    }

    draw() {
        const most = Math.max(1, ...this.#rates) * HEADROOM;
        const left = WIDTH - (this.#rates.length - 1) * WIDTH / (POINTS - 1);
        const points = this.#rates.map((rate, i) => `${(left + i * WIDTH / (POINTS - 1)).toFixed(1)},${(HEIGHT - 1 - rate / most * (HEIGHT - 2)).toFixed(1)}`);
        const line = `M${points.join("L")}`;
        this.#line.setAttribute("d", line);
        this.#area.setAttribute("d", `${line}L${WIDTH},${HEIGHT}L${left.toFixed(1)},${HEIGHT}Z`);
    }
}
