// SPDX-License-Identifier: Apache-2.0
import {byId, setText} from "../base/dom.js";
import {formatNumber} from "../base/format.js";
import {distanceOf} from "./view.js";

const APERTURE_MAX = 0.08; // of the distance to what is looked at
const FOCUS_RANGE = 20; // times nearer, and farther, than that

/** The sliders of aperture, focus and field of view. "view" comes with the view that they make of the last. */
export class LensPanel extends EventTarget {
    #view = null;
    #aperture = byId("aperture");
    #focus = byId("focus");
    #fov = byId("fov");
    #reach = 1;
    #apertureMax = 1;

    constructor() {
        super();
        for (const slider of [this.#aperture, this.#focus, this.#fov])
            slider.addEventListener("input", () => this.#change(slider));
    }

    /** The sliders' ranges follow from the first view; they stay while it is moved. */
    start(view) {
        this.#reach = distanceOf(view);
        this.#apertureMax = Math.max(APERTURE_MAX * this.#reach, 2 * view.aperture_radius);
        this.show(view);
    }

    show(view) {
        this.#view = view;
        this.#aperture.value = Math.sqrt(view.aperture_radius / this.#apertureMax);
        this.#focus.value = Math.log(view.focus_distance / this.#reach) / Math.log(FOCUS_RANGE);
        this.#fov.value = view.horizontal_fov;
        this.#label();
    }

    #change(slider) {
        const view = {...this.#view};
        if (slider === this.#aperture)
            view.aperture_radius = this.#apertureMax * slider.valueAsNumber ** 2;
        else if (slider === this.#focus)
            view.focus_distance = this.#reach * FOCUS_RANGE ** slider.valueAsNumber;
        else
            view.horizontal_fov = slider.valueAsNumber;
        this.#view = view;
        this.#label();
        this.dispatchEvent(new CustomEvent("view", {detail: view}));
    }

    #label() {
        const {aperture_radius: aperture, focus_distance: focus, horizontal_fov: fov} = this.#view;
        const texts = {aperture: aperture > 0 ? formatNumber(aperture) : "pinhole", focus: formatNumber(focus), fov: `${Math.round(fov)}°`};
        for (const [name, text] of Object.entries(texts)) {
            setText(byId(`${name}-value`), text);
            byId(name).setAttribute("aria-valuetext", text);
        }
    }
}
