// SPDX-License-Identifier: Apache-2.0
// Files of the service in elements. Elements fetch by themselves and show no token: where there is one,
// the page fetches for them.

import {ask} from "./client.js";
import {hasToken} from "./token.js";

const wanted = new WeakMap();
const seen = new IntersectionObserver((entries) => {
    for (const {target} of entries.filter(({isIntersecting}) => isIntersecting)) {
        seen.unobserve(target);
        void load(target, wanted.get(target));
    }
});

async function load(picture, path) {
    try {
        const url = URL.createObjectURL(await (await ask("GET", path)).blob());
        picture.addEventListener("load", () => URL.revokeObjectURL(url), {once: true});
        picture.src = url;
    } catch {
        picture.dispatchEvent(new Event("error"));
    }
}

/** Shows a picture in an img, fetched when it comes into view. */
export function showPicture(picture, path) {
    if (!hasToken()) {
        picture.src = path;
        return;
    }
    wanted.set(picture, path);
    seen.observe(picture);
}

/** Has a link with an address and a name to save under do so with the token. */
export async function saveLinked(event) {
    const link = event.currentTarget;
    if (!hasToken() || link.href.startsWith("blob:"))
        return;
    event.preventDefault();
    const url = URL.createObjectURL(await (await ask("GET", link.href)).blob());
    const save = document.createElement("a");
    save.href = url;
    save.download = link.download;
    save.click();
    setTimeout(() => URL.revokeObjectURL(url), 60000);
}
