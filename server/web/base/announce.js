// SPDX-License-Identifier: Apache-2.0
// What changed, for those who hear the page and for those who look at its corner.

import {byId, element} from "./dom.js";

const SHOWN_MS = 6000;

/** Says a sentence through the live region alone. */
export function announce(text) {
    byId("live").textContent = text;
}

/** Says a sentence and shows it for a while; kind is "note" or "fault". */
export function notify(text, kind = "note") {
    const note = element("div", {class: `toast ${kind}`}, text);
    byId("toasts").append(note);
    announce(text);
    setTimeout(() => note.remove(), SHOWN_MS);
}
