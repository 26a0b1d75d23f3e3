// SPDX-License-Identifier: Apache-2.0
import {byId, element, setHidden, setText} from "../base/dom.js";
import {formatCount, formatDuration, formatPercent, formatRate, isOver, nameOf, stateOf} from "../base/format.js";
import {announce} from "../base/announce.js";
import {imagePath} from "../service/client.js";
import {saveLinked} from "../service/file.js";
import {Rate} from "./rate.js";

const FORMATS = [["png", "PNG", "for the eye"], ["exr", "OpenEXR", "linear, all layers"], ["jpg", "JPEG", "small"], ["hdr", "Radiance", "linear"]];

/** What is known of the render that is shown: state, progress, facts, faults, downloads. */
export class Details {
    #id = null;
    #state = null;
    #rate = new Rate();

    constructor() {
        byId("downloads").append(...FORMATS.map(([extension, name, what]) => element("a",
            {class: "download", "data-extension": extension, onclick: saveLinked}, element("b", {}, name), element("span", {}, what))));
    }

    show(render) {
        if (render.id !== this.#id) {
            this.#id = render.id;
            this.#state = null;
            this.#rate = new Rate();
        }
        this.#rate.add(render.samples_done);
        setText(byId("render-name"), nameOf(render));
        this.#showState(render);
        this.#showFacts(render);
        this.#showFaults(render);
        this.#showDownloads(render);
    }

    #showState(render) {
        const chip = byId("render-state");
        setText(chip, stateOf(render));
        chip.className = `chip ${render.state}`;
        byId("render-progress").value = render.progress;
        setText(byId("render-percent"), formatPercent(render.progress));
        setHidden(byId("progress-block"), isOver(render));
        setHidden(byId("pause"), render.state !== "running" && render.state !== "queued");
        setHidden(byId("resume"), render.state !== "paused");
        setHidden(byId("cancel"), isOver(render));
        if (this.#state && this.#state !== render.state)
            announce(`${nameOf(render)}: ${stateOf(render)}`);
        this.#state = render.state;
    }

    #showFacts(render) {
        const rate = this.#rate.perSecond;
        const facts = {
            size: `${render.width} × ${render.height}`,
            samples: `${formatCount(render.samples)} a pixel`,
            time: render.started ? formatDuration(render.seconds) : "–",
            rate: isOver(render) ? (render.seconds > 0 ? formatRate(render.samples_done / render.seconds) : "–")
                : rate > 0 ? formatRate(rate) : "–",
            eta: render.eta_seconds === null ? "–" : formatDuration(render.eta_seconds),
            frames: render.frames.total > 1 ? `${render.frames_done ?? render.frames.done} of ${render.frames.total}` : "",
            machine: render.class ?? "",
            id: render.id,
        };
        for (const [name, text] of Object.entries(facts)) {
            setText(byId(`fact-${name}`), text);
            setHidden(byId(`fact-${name}`).parentElement, !text || (name === "eta" && isOver(render)));
        }
    }

    #showFaults(render) {
        const lines = [render.error, ...render.errors.map(({pointer, detail}) => `${pointer}: ${detail}`)].filter(Boolean);
        byId("faults").replaceChildren(...lines.map((line) => element("li", {class: "fault"}, line)),
            ...render.warnings.map((line) => element("li", {class: "warning"}, line)));
        setHidden(byId("faults"), lines.length + render.warnings.length === 0);
    }

    #showDownloads(render) {
        for (const link of byId("downloads").children) {
            const extension = link.dataset.extension;
            link.href = imagePath(render.id, extension);
            link.download = `${nameOf(render).replace(/[^\w.-]+/g, "_")}.${extension}`;
            link.classList.toggle("disabled", render.samples_done === 0);
        }
    }
}
