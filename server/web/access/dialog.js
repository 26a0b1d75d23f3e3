// SPDX-License-Identifier: Apache-2.0
import {byId, setHidden} from "../base/dom.js";
import {access, setToken} from "../service/token.js";

/** Asks for a token when the service does, and begins anew with it. */
export function askForToken() {
    const dialog = byId("token-dialog");

    access.addEventListener("wanted", ({detail}) => {
        setHidden(byId("token-fault"), !detail.wasRefused);
        if (!dialog.open)
            dialog.showModal();
    });
    byId("token-form").addEventListener("submit", (event) => {
        event.preventDefault();
        setToken(event.target.elements.token.value.trim());
        location.reload();
    });
}
