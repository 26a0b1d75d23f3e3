// SPDX-License-Identifier: Apache-2.0
import {byId, element, setHidden, setText} from "../base/dom.js";
import {nameOf} from "../base/format.js";

/** Exposure, layer, and the render to compare with: what is looked at, not what is rendered. */
export class LookPanel extends EventTarget {
    #exposure = byId("exposure");
    #layer = byId("layer");
    #other = byId("compare-with");

    constructor(store) {
        super();
        this.#exposure.addEventListener("input", () => this.#change());
        this.#exposure.addEventListener("dblclick", () => this.reset());
        byId("exposure-reset").addEventListener("click", () => this.reset());
        this.#layer.addEventListener("change", () => this.#change());
        this.#other.addEventListener("focus", () => this.#fill(store.renders));
        this.#other.addEventListener("pointerdown", () => this.#fill(store.renders));
        this.#other.addEventListener("change", () => this.dispatchEvent(new CustomEvent("compare", {detail: this.#other.value})));
    }

    /** base: the stops of the scene itself, to which the slider adds. */
    start(render, base = 0) {
        this.current = render.id;
        this.base = base;
        this.#exposure.value = 0;
        this.#layer.value = "";
        this.#other.replaceChildren(element("option", {value: ""}, "nothing"));
        this.#show();
    }

    reset() {
        this.#exposure.value = 0;
        this.#change();
    }

    /** After a layer that there is not. */
    showColor() {
        this.#layer.value = "";
        this.#change();
    }

    /** While the camera moves there is only colour, and nothing to compare with. */
    lockLayer(locked) {
        if (locked)
            this.#layer.value = this.#other.value = "";
        this.#layer.disabled = this.#other.disabled = locked;
        this.#show();
    }

    #change() {
        this.#show();
        const stops = Number(this.#exposure.value);
        this.dispatchEvent(new CustomEvent("look", {detail: {
            exposure: stops === 0 ? undefined : stops + this.base, layer: this.#layer.value,
        }}));
    }

    #show() {
        const stops = Number(this.#exposure.value);
        setText(byId("exposure-value"), `${stops > 0 ? "+" : ""}${stops.toFixed(1)} EV`);
        setHidden(byId("exposure-reset"), stops === 0);
        setHidden(byId("heat-legend"), this.#layer.value !== "samples");
        this.#exposure.disabled = this.#layer.value !== "";
    }

    #fill(renders) {
        const chosen = this.#other.value;
        const others = renders.filter((render) => render.id !== this.current && render.samples_done > 0).slice(0, 100);
        this.#other.replaceChildren(element("option", {value: ""}, "nothing"),
            ...others.map((render) => element("option", {value: render.id}, nameOf(render))));
        this.#other.value = others.some((render) => render.id === chosen) ? chosen : "";
    }
}
