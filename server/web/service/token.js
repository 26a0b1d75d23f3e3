// SPDX-License-Identifier: Apache-2.0
// The token that the service asks for, if it does: typed in once, forgotten with the tab.

const KEY = "penumbra-token";

/** "wanted" comes when the service has refused what it was shown, or that nothing was. */
export const access = new EventTarget();

export const hasToken = () => sessionStorage.getItem(KEY) !== null;

export function setToken(token) {
    sessionStorage.setItem(KEY, token);
}

/** What a request's fields must have for the service to answer it. */
export function authorization() {
    return hasToken() ? {Authorization: `Bearer ${sessionStorage.getItem(KEY)}`} : {};
}

export function wantToken() {
    access.dispatchEvent(new CustomEvent("wanted", {detail: {wasRefused: hasToken()}}));
}
