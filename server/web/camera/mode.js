// SPDX-License-Identifier: Apache-2.0
import {announce, notify} from "../base/announce.js";
import {byId, setHidden, setText} from "../base/dom.js";
import {formatPercent, nameOf} from "../base/format.js";
import {getRenderScene, putScene, submitRender} from "../service/client.js";
import {LensPanel} from "./lens.js";
import {distanceAt} from "./probe.js";
import {CameraSession} from "./session.js";
import {cameraTool} from "./tool.js";
import {focusAt, overrideOf, viewOf} from "./view.js";

/**
 * The mode in which the scene of the render that is shown is turned round. "enter" and "leave" come
 * with it, "render" with a new render of the view that was found.
 */
export class CameraMode extends EventTarget {
    session = null;
    #viewer;
    #lens = new LensPanel();
    #hash = null;
    #first = null;

    constructor(viewer) {
        super();
        this.#viewer = viewer;
        this.#lens.addEventListener("view", ({detail}) => this.session.set(detail));
        byId("focus-centre").addEventListener("click", () => this.#focus(0.5, 0.5));
        byId("view-reset").addEventListener("click", () => this.#key("r"));
        byId("render-view").addEventListener("click", () => this.#render());
    }

    /** Keeps the render's scene for many views and shows the first; false when its camera is not known. */
    async enter(render) {
        const {text, hash} = await getRenderScene(render.id);
        const scene = JSON.parse(text);
        const view = viewOf(scene);
        if (!view) {
            notify("The camera of this render lies in its glTF file, which was not uploaded from this browser.", "fault");
            return false;
        }
        await putScene(hash, text);
        this.#hash = hash;
        this.#first = view;
        this.#viewer.rest();
        this.#lens.start(view);
        this.#begin(scene, view);
        setHidden(byId("camera-panel"), false);
        this.dispatchEvent(new Event("enter"));
        announce("Camera mode: arrow keys turn, with Shift they move aside, plus and minus go nearer and farther, F focuses on the centre.");
        return true;
    }

    leave() {
        if (!this.session)
            return;
        this.session.close();
        this.session = null;
        setHidden(byId("camera-panel"), true);
        this.dispatchEvent(new Event("leave"));
    }

    /** Renders the view anew, as after a restart of the service. */
    refresh() {
        this.session?.set(this.session.view);
    }

    /** The tool for the viewer's input. */
    get tool() {
        return cameraTool(this.session, this.#viewer.zoom, (u, v) => this.#focus(u, v), (key) => this.#key(key));
    }

    #begin(scene, view) {
        const session = new CameraSession(this.#hash, scene, view, this.#viewer.stage);
        const status = (text) => setText(byId("camera-status"), text);
        session.exposure = this.#viewer.look.exposure;
        session.addEventListener("quick", ({detail: {ms, width, height}}) => {
            this.#lens.show(session.view);
            status(`${Math.round(ms)} ms · ${width}×${height}`);
            byId("camera-status").dataset.ms = Math.round(ms);
        });
        session.addEventListener("refining", ({detail}) => status(`refining · ${formatPercent(detail)}`));
        session.addEventListener("settled", ({detail}) => status(`settled · ${detail} samples a pixel`));
        session.addEventListener("fault", ({detail}) => status(detail));
        this.session = session;
        session.set(view);
    }

    async #focus(u, v) {
        const {session} = this;
        try {
            const distance = await distanceAt(this.#hash, session.view, u, v, session.current);
            if (session !== this.session)
                return;
            if (distance === null) {
                announce("There is nothing to focus on.");
                return;
            }
            this.#mark(u, v);
            session.set(focusAt(session.view, u, v, distance));
        } catch (refusal) {
            notify(refusal.message, "fault");
        }
    }

    #mark(u, v) {
        const mark = byId("focus-mark");
        mark.style.left = `${100 * u}%`;
        mark.style.top = `${100 * v}%`;
        mark.style.setProperty("--zoom", this.#viewer.zoom.scale);
        mark.classList.remove("shown");
        requestAnimationFrame(() => mark.classList.add("shown"));
    }

    #key(key) {
        if (key === "f") {
            void this.#focus(0.5, 0.5);
        } else {
            this.session.set(this.#first);
            this.#lens.show(this.#first);
        }
    }

    async #render() {
        try {
            const name = `${nameOf(this.#viewer.render)} (view)`.slice(0, 80);
            const render = await submitRender({
                scene: `sha256:${this.#hash}`, override: {camera: overrideOf(this.session.view)}, options: {name},
            });
            this.dispatchEvent(new CustomEvent("render", {detail: render}));
        } catch (refusal) {
            notify(refusal.message, "fault");
        }
    }
}
