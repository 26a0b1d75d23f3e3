// SPDX-License-Identifier: Apache-2.0
import {ask, imagePath, removeRender, submitRender} from "../service/client.js";
import {probeEnvelope} from "./envelope.js";

/** The value of the one pixel of a Radiance file: its last four bytes are mantissas and exponent. */
function valueOf(bytes) {
    const [red, , , exponent] = bytes.slice(-4);
    return exponent === 0 ? 0 : (red + 0.5) * 2 ** (exponent - 136);
}

/**
 * How far away the scene is in the direction of a point of the image, by rendering that point alone;
 * null where there is nothing. replaces: the preview that need not go on.
 */
export async function distanceAt(hash, view, u, v, replaces) {
    const render = await submitRender(probeEnvelope(hash, view, u, v, replaces), {seconds: 10});
    const answer = await ask("GET", imagePath(render.id, "hdr", {layer: "depth"}));
    const nearness = valueOf(new Uint8Array(await answer.arrayBuffer())); // 1 / (1 + depth), as images show it
    removeRender(render.id).catch(() => {});
    return nearness > 1e-9 && nearness < 1 ? 1 / nearness - 1 : null;
}
