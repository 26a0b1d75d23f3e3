// SPDX-License-Identifier: Apache-2.0
import {element, setHidden, setText} from "../base/dom.js";
import {formatAge, formatCount, formatPercent, isOver, nameOf, stateOf} from "../base/format.js";
import {thumbnailPath} from "../service/client.js";
import {showPicture} from "../service/file.js";

/** The address of a small picture of the render, or null while there is none. */
function thumbnailOf(render) {
    if (render.samples_done === 0)
        return null;
    const step = isOver(render) ? "end" : Math.floor(render.progress * 4);
    return `${thumbnailPath(render, 192)}?at=${step}`;
}

/** A line of the list of renders: a link with a picture, a name, and how far it is. */
export class RenderRow {
    #picture = element("img", {alt: "", loading: "lazy", decoding: "async", width: "96", height: "54"});
    #name = element("span", {class: "row-name"});
    #state = element("span", {class: "row-state"});
    #age = element("span", {class: "row-age"});
    #facts = element("span", {class: "row-facts"});
    #bar = element("span", {class: "bar"}, element("span", {class: "bar-fill"}));
    #link;
    #shown = null;

    constructor(render) {
        this.#link = element("a", {class: "row", href: `#/renders/${render.id}`},
            element("span", {class: "thumbnail"}, this.#picture),
            element("span", {class: "row-text"}, this.#name, element("span", {class: "row-line"}, this.#state, this.#age), this.#facts, this.#bar));
        this.node = element("li", {}, this.#link);
        this.#picture.addEventListener("error", () => setHidden(this.#picture, true));
    }

    update(render, isCurrent) {
        const source = thumbnailOf(render);
        if (source && source !== this.#shown) {
            this.#shown = source;
            showPicture(this.#picture, source);
            setHidden(this.#picture, false);
        }
        setText(this.#name, nameOf(render));
        setText(this.#state, render.state === "running" ? formatPercent(render.progress) : stateOf(render));
        this.#state.className = `row-state ${render.state}`;
        setText(this.#facts, `${render.width}×${render.height} · ${formatCount(render.samples)} spp`);
        setText(this.#age, formatAge(render.created));
        setHidden(this.#bar, isOver(render));
        this.#bar.firstChild.style.width = `${render.progress * 100}%`;
        if (isCurrent)
            this.#link.setAttribute("aria-current", "true");
        else
            this.#link.removeAttribute("aria-current");
    }
}
