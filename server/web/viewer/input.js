// SPDX-License-Identifier: Apache-2.0
import {byId} from "../base/dom.js";

const CLICK_PX = 4;

/**
 * Pointer, wheel and keys on the viewport, given to whichever tool is chosen. A tool has drag(dx, dy,
 * event), click(event), wheel(event) and key(event), the last true when it was for it.
 */
export class Input {
    tool = null;
    #viewport = byId("viewport");
    #last = null;
    #moved = 0;

    constructor() {
        const on = (name, listener) => this.#viewport.addEventListener(name, listener, {passive: false});
        on("pointerdown", (event) => this.#down(event));
        on("pointermove", (event) => this.#move(event));
        on("pointerup", (event) => this.#up(event));
        on("pointercancel", () => { this.#last = null; });
        on("contextmenu", (event) => event.preventDefault());
        on("wheel", (event) => {
            event.preventDefault();
            this.tool?.wheel(event);
        });
        on("keydown", (event) => {
            if (!event.ctrlKey && !event.metaKey && !event.altKey && this.tool?.key(event))
                event.preventDefault();
        });
    }

    #down(event) {
        this.#viewport.setPointerCapture(event.pointerId);
        this.#last = [event.clientX, event.clientY];
        this.#moved = 0;
    }

    #move(event) {
        if (!this.#last)
            return;
        const dx = event.clientX - this.#last[0], dy = event.clientY - this.#last[1];
        this.#moved += Math.abs(dx) + Math.abs(dy);
        this.#last = [event.clientX, event.clientY];
        if (this.#moved > CLICK_PX)
            this.tool?.drag(dx, dy, event);
    }

    #up(event) {
        if (this.#last && this.#moved <= CLICK_PX)
            this.tool?.click(event);
        this.#last = null;
    }
}

/** The tool that moves and magnifies the image. */
export function inspectTool(zoom) {
    return {
        drag: (dx, dy) => zoom.pan(dx, dy),
        click: () => {},
        wheel: (event) => zoom.wheel(event),
        key: (event) => zoom.key(event),
    };
}
