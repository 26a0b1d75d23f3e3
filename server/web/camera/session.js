// SPDX-License-Identifier: Apache-2.0
import {Latest} from "../base/latest.js";
import {getBitmap, imagePath, removeRender, submitRender} from "../service/client.js";
import {Live} from "../viewer/live.js";
import {viewEnvelope} from "./envelope.js";

const TARGET_MS = 80;
const STILL_MS = 180;
const PIXELS_MIN = 160 * 90;
const PIXELS_FIRST = 400 * 225;
const REFINE_PIXELS_MAX = 1920 * 1080;

/**
 * A scene that is being turned round: each view is rendered at once, as large as the time allows, and
 * in full when nothing has moved for a moment. "quick" comes with {ms, width, height}, "refining" with
 * the share that is done, "settled" and "fault" with what their names say.
 */
export class CameraSession extends EventTarget {
    view;
    exposure = undefined;
    #hash;
    #stage;
    #size;
    #samples;
    #pixels = PIXELS_FIRST;
    #quick = new Latest((view) => this.#show(view));
    #last = null; // the id of the preview that the next one replaces
    #live = null;
    #still = null;
    #closed = false;
    #ending = new AbortController();

    constructor(hash, scene, view, stage) {
        super();
        this.#hash = hash;
        this.#stage = stage;
        this.#size = {width: scene.image.width, height: scene.image.height};
        this.#samples = scene.sampling.samples;
        this.view = view;
    }

    /** The id of the preview that is shown. */
    get current() {
        return this.#last;
    }

    set(view) {
        this.view = view;
        clearTimeout(this.#still);
        this.#quick.push(view);
    }

    close() {
        this.#closed = true;
        this.#ending.abort();
        clearTimeout(this.#still);
        this.#quick.clear();
        this.#stopLive();
        this.#discard(this.#last);
    }

    /** The size of so many pixels with the image's sides; never larger than the image. */
    #sizeOf(pixels) {
        const {width, height} = this.#size;
        const by = Math.min(1, Math.sqrt(pixels / (width * height)));
        return {width: Math.max(1, Math.round(width * by)), height: Math.max(1, Math.round(height * by))};
    }

    async #show(view) {
        const start = performance.now();
        const size = this.#sizeOf(this.#pixels);
        this.#stopLive();
        try {
            const render = await this.#post(view, {...size, samples: 1, priority: 100}, 10);
            if (this.#closed)
                return;
            const {bitmap} = await getBitmap(imagePath(render.id, "jpg", {exposure: this.exposure}), this.#ending.signal);
            if (this.#closed)
                return;
            this.#stage.draw(bitmap);
            this.#pace(performance.now() - start, size);
            clearTimeout(this.#still);
            this.#still = setTimeout(() => this.#refine(view), STILL_MS);
        } catch (refusal) {
            this.#fail(refusal);
        }
    }

    /** Posts a view in place of the one before, which goes. */
    async #post(view, settings, seconds) {
        const before = this.#last;
        const render = await submitRender(viewEnvelope(this.#hash, view, settings, before), {seconds});
        this.#last = render.id;
        this.#discard(this.#closed ? render.id : before);
        return render;
    }

    /** More pixels when there was time left, fewer when there was not. */
    #pace(ms, size) {
        const full = this.#size.width * this.#size.height;
        const by = Math.min(1.6, Math.max(0.4, TARGET_MS / ms));
        this.#pixels = Math.min(full, Math.max(PIXELS_MIN, this.#pixels * by));
        this.#tell("quick", {ms, ...size});
    }

    async #refine(view) {
        if (this.#closed || view !== this.view)
            return;
        try {
            const size = this.#sizeOf(REFINE_PIXELS_MAX);
            const {id} = await this.#post(view, {...size, samples: this.#samples, priority: 80});
            if (this.#closed || view !== this.view)
                return;
            this.#live = new Live(id, imagePath(id, "jpg", {exposure: this.exposure}), this.#stage, true);
            this.#live.addEventListener("progress", ({detail}) => this.#tell("refining", detail.progress));
            this.#live.addEventListener("done", ({detail}) => this.#settle(detail));
        } catch (refusal) {
            this.#fail(refusal);
        }
    }

    async #settle(render) {
        if (render?.state === "done" && !this.#closed && render.id === this.#last) {
            try {
                const {bitmap} = await getBitmap(imagePath(render.id, "jpg", {exposure: this.exposure}), this.#live?.signal);
                if (this.#live && render.id === this.#last) {
                    this.#stage.draw(bitmap);
                    this.#tell("settled", render.samples);
                }
            } catch (refusal) {
                this.#fail(refusal);
            }
        } else if (render?.state === "failed") {
            this.#tell("fault", render.error ?? "The scene cannot be rendered.");
        }
    }

    #stopLive() {
        this.#live?.close();
        this.#live = null;
    }

    #discard(id) {
        if (id)
            removeRender(id).catch(() => {});
    }

    #fail(refusal) {
        if (!this.#closed && refusal.name !== "AbortError")
            this.#tell("fault", refusal.status ? refusal.message : "The service does not answer.");
    }

    #tell(name, detail) {
        this.dispatchEvent(new CustomEvent(name, {detail}));
    }
}
