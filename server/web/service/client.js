// SPDX-License-Identifier: Apache-2.0
// Requests to the service that the page came from.

import {authorization, wantToken} from "./token.js";

/** What the service answered in place of what was asked for; faults are {pointer, detail}. */
export class Refusal extends Error {
    constructor(status, detail, faults = []) {
        super(detail);
        this.status = status;
        this.faults = faults;
    }
}

async function refusalOf(answer) {
    const problem = await answer.json().catch(() => ({}));
    return new Refusal(answer.status, problem.detail ?? `The service answered ${answer.status}.`, problem.errors);
}

/** An answer that is good; a Refusal, or a TypeError when nobody answers. */
export async function ask(method, path, options = {}) {
    const headers = {...options.headers, ...authorization()};
    const answer = await fetch(path, {method, cache: "no-cache", ...options, headers});
    if (answer.status === 401)
        wantToken();
    if (!answer.ok)
        throw await refusalOf(answer);
    return answer;
}

async function askJson(method, path, options) {
    return (await ask(method, path, options)).json();
}

const json = (body, headers = {}) => ({
    body: JSON.stringify(body), headers: {"Content-Type": "application/json", ...headers},
});

export const renderPath = (id) => `/v1/renders/${encodeURIComponent(id)}`;

/** The path of a render's image: extension, and a query of exposure and layer where given. */
export function imagePath(id, extension, query = {}) {
    const given = Object.entries(query).filter(([, value]) => value !== undefined && value !== null && value !== "");
    const text = new URLSearchParams(given).toString();
    return `${renderPath(id)}/image.${extension}${text && "?" + text}`;
}

/** The path of a small picture of a render, of at most so many pixels across. */
export function thumbnailPath(render, width) {
    return `${renderPath(render.id)}/iiif/full/${Math.min(width, render.width)},/0/default.jpg`;
}

export const getFarm = () => askJson("GET", "/v1/farm");
export const getWorkers = async () => (await askJson("GET", "/v1/workers")).workers;
export const getRender = (id) => askJson("GET", renderPath(id));
export const changeRender = (id, change) => askJson("PATCH", renderPath(id), json(change));
export const removeRender = (id) => ask("DELETE", renderPath(id));

/** A page of renders: {renders, next}. */
export function listRenders({state, limit, cursor}) {
    const given = Object.entries({state, limit, cursor}).filter(([, value]) => value);
    return askJson("GET", `/v1/renders?${new URLSearchParams(given)}`);
}

/** Posts an envelope; with seconds, the answer comes when it is over or they have passed. */
export function submitRender(envelope, {seconds, signal} = {}) {
    return askJson("POST", "/v1/renders", {...json(envelope, seconds ? {Prefer: `wait=${seconds}`} : {}), signal});
}

/** Posts a GLB, its settings in the query. */
export function submitGlb(file, settings) {
    const given = Object.entries(settings).filter(([, value]) => value !== undefined && value !== "");
    return askJson("POST", `/v1/renders?${new URLSearchParams(given)}`,
        {body: file, headers: {"Content-Type": "model/gltf-binary"}});
}

/** The scene of a render as text, and its hash. */
export async function getRenderScene(id) {
    const answer = await ask("GET", `${renderPath(id)}/scene`);
    return {text: await answer.text(), hash: answer.headers.get("ETag").replaceAll('"', "")};
}

export function putScene(hash, text) {
    return ask("PUT", `/v1/scenes/sha256/${hash}`, {body: text, headers: {"Content-Type": "application/json"}});
}

export function putAsset(hash, bytes) {
    return ask("PUT", `/v1/assets/sha256/${hash}`, {body: bytes, headers: {"Content-Type": "application/octet-stream"}});
}

/** An image as a bitmap, and the share of it that is rendered. */
export async function getBitmap(path, signal) {
    const answer = await ask("GET", path, {signal});
    const bitmap = await createImageBitmap(await answer.blob());
    return {bitmap, progress: Number(answer.headers.get("Penumbra-Progress"))};
}
