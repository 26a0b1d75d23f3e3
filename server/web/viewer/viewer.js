// SPDX-License-Identifier: Apache-2.0
import {byId, setHidden, setText} from "../base/dom.js";
import {isOver, nameOf} from "../base/format.js";
import {Latest} from "../base/latest.js";
import {getBitmap, getRender} from "../service/client.js";
import {wholePath} from "../service/picture.js";
import {Compare} from "./compare.js";
import {DeepZoom} from "./deep.js";
import {heat} from "./heat.js";
import {Holders} from "./holders.js";
import {Live} from "./live.js";
import {Stage} from "./stage.js";
import {Zoom} from "./zoom.js";

/**
 * Shows a render, live while it is being rendered. "render" comes with what is known of it, "refused"
 * with the sentence of the service when it has no such layer or image.
 */
export class Viewer extends EventTarget {
    stage = new Stage(byId("canvas"), byId("glow"));
    zoom = new Zoom(byId("viewport"), byId("sheet"));
    render = null;
    look = {exposure: undefined, layer: ""};
    #deep = new DeepZoom(byId("viewport"), byId("detail"), this.zoom);
    #compare = new Compare(byId("sheet"));
    #holders = new Holders(this.stage);
    #live = null;
    #resting = false;
    #loads = new Latest(() => this.#load());

    /** Shows a render from its beginning. */
    open(render) {
        this.close();
        this.#resting = false;
        this.render = render;
        this.stage.clear(render.width, render.height);
        this.zoom.setSize(render.width, render.height);
        setHidden(byId("sheet"), false);
        this.#follow();
    }

    close() {
        this.#live?.close();
        this.#live = null;
        this.#holders.show([]);
        this.render = null;
        this.#deep.show(null);
        this.#compare.hide();
        this.say("");
        setHidden(byId("sheet"), true);
    }

    /** A sentence in the place of an image. */
    say(text) {
        setText(byId("stage-message"), text);
        setHidden(byId("stage-message"), !text);
    }

    /** Exposure in stops, or undefined as the scene says; layer "" for the colour. */
    setLook(look) {
        Object.assign(this.look, look);
        this.#loads.push(null);
    }

    /** Shows another render right of a line; null shows none. */
    async compare(id) {
        if (!id) {
            this.#compare.hide();
            this.#showDetails();
            return;
        }
        const other = await getRender(id);
        const {bitmap} = await getBitmap(wholePath(other, this.#query()));
        this.#deep.show(null);
        this.#compare.show(bitmap, nameOf(other));
    }

    /** Whether the render's picture is what is shown. */
    get isResting() {
        return this.#resting;
    }

    /** Stops to follow the render, whose picture stays: somebody else draws. */
    rest() {
        this.#resting = true;
        this.#live?.close();
        this.#live = null;
        this.#holders.show([]);
        this.#deep.show(null);
        this.#compare.hide();
        this.say("");
    }

    /** Follows the render again. */
    resume() {
        if (this.render)
            this.open(this.render);
    }

    /** Details are of plain images that are over. */
    #showDetails() {
        const isPlain = !this.look.layer && this.look.exposure === undefined;
        this.#deep.show(isPlain && isOver(this.render) ? this.render : null);
    }

    #query() {
        return {exposure: this.look.layer ? undefined : this.look.exposure, layer: this.look.layer};
    }

    #follow() {
        if (isOver(this.render) || this.look.layer) {
            this.#loads.push(null);
            if (isOver(this.render))
                return;
        }
        this.#live = new Live(this.render.id, wholePath(this.render, this.#query()), this.stage);
        this.#live.addEventListener("held", ({detail}) => this.#holders.show(detail));
        this.#live.addEventListener("progress", ({detail}) => this.#tell({...this.render, ...detail}));
        this.#live.addEventListener("done", ({detail}) => this.#finish(detail));
    }

    #finish(render) {
        this.#live = null;
        this.#holders.show([]);
        if (!render) {
            this.say("This render was removed.");
            this.dispatchEvent(new Event("removed"));
            return;
        }
        this.#tell(render);
        this.#loads.push(null);
    }

    #tell(render) {
        this.render = render;
        this.dispatchEvent(new CustomEvent("render", {detail: render}));
    }

    /** The image as it is now, as a whole. */
    async #load() {
        const render = this.render;
        if (!render || this.#resting)
            return;
        try {
            const {bitmap} = await getBitmap(wholePath(render, this.#query(), this.look.layer === "samples" ? "png" : "jpg"));
            const shown = this.look.layer === "samples" ? await heat(bitmap) : bitmap;
            if (this.render?.id === render.id && !this.#resting) {
                this.stage.draw(shown);
                this.#showDetails();
                this.say("");
                this.dispatchEvent(new Event("shown"));
            }
        } catch (refusal) {
            if (this.render?.id !== render.id)
                return;
            if (refusal.status === 409)
                this.say("It ended before any of it was rendered.");
            else
                this.dispatchEvent(new CustomEvent("refused", {detail: refusal}));
        }
    }
}
