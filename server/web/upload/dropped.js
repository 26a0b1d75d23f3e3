// SPDX-License-Identifier: Apache-2.0
// Files that were dropped, pasted or chosen: which is the scene, and what it needs of the others.

import {sha256} from "../base/digest.js";
import {putAsset} from "../service/client.js";

const FILE_KEYS = ["image", "asset"];
const GLB_MAGIC = 0x46546c67; // "glTF"

/** The places of a scene that name a file by a path, as {holder, key, name}. */
function* pathsOf(node) {
    if (node === null || typeof node !== "object")
        return;
    for (const [key, value] of Object.entries(node)) {
        if (FILE_KEYS.includes(key) && typeof value === "string" && !value.startsWith("sha256:"))
            yield {holder: node, key, name: value.split("/").at(-1)};
        else
            yield* pathsOf(value);
    }
}

async function upload(file) {
    const bytes = await file.arrayBuffer();
    const hash = await sha256(bytes);
    await putAsset(hash, bytes);
    return `sha256:${hash}`;
}

/**
 * A scene of JSON text, with the files that it names by path uploaded from among those that came with
 * it. Throws an Error with a sentence.
 */
export async function readScene(text, files, name) {
    let scene;
    try {
        scene = JSON.parse(text);
    } catch (error) {
        throw new Error(`This is no JSON: ${error.message}`);
    }
    if (scene === null || typeof scene !== "object" || Array.isArray(scene))
        throw new Error("A scene is a JSON object.");
    scene = scene.scene !== null && typeof scene.scene === "object" ? scene.scene : scene;
    for (const {holder, key, name: wanted} of pathsOf(scene)) {
        const file = files.find((candidate) => candidate.name === wanted);
        if (!file)
            throw new Error(`The scene names the file “${wanted}”: drop it together with the scene.`);
        holder[key] = await upload(file);
    }
    return {kind: "scene", name, scene};
}

/** The scene or GLB among files. Throws an Error with a sentence. */
export async function readFiles(files) {
    for (const file of files) {
        const head = new DataView(await file.slice(0, 4).arrayBuffer());
        if (head.byteLength === 4 && head.getUint32(0, true) === GLB_MAGIC && files.length === 1)
            return {kind: "glb", name: file.name.replace(/\.glb$/i, ""), file};
    }
    const json = files.find((file) => /\.json$/i.test(file.name)) ?? files.find((file) => file.type === "application/json");
    if (json)
        return readScene(await json.text(), files, json.name.replace(/\.json$/i, ""));
    throw new Error("Neither a scene (.json) nor a model (.glb).");
}
