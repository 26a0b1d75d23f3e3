// SPDX-License-Identifier: Apache-2.0
// The cameras of glTF files that were uploaded from here: the service does not give files out again, so
// that the page remembers what it needs to move such a camera.

import {dot, normalize, scale, subtract} from "../base/vector.js";
import {multiply, poseOf, transform, turn} from "./matrix.js";

const KEY = "penumbra.cameras.";
const HEADER_BYTES = 12;
const CHUNK_HEADER_BYTES = 8;
const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

async function treeOf(file) {
    const header = new DataView(await file.slice(HEADER_BYTES, HEADER_BYTES + CHUNK_HEADER_BYTES).arrayBuffer());
    const begin = HEADER_BYTES + CHUNK_HEADER_BYTES;
    return JSON.parse(await file.slice(begin, begin + header.getUint32(0, true)).text());
}

/** Each node of the default scene with its matrix, parents first. */
function* nodesOf(tree) {
    const left = (tree.scenes?.[tree.scene ?? 0]?.nodes ?? []).map((index) => [index, IDENTITY]);
    while (left.length > 0) {
        const [index, parent] = left.shift();
        const node = tree.nodes[index];
        const matrix = multiply(parent, node.matrix ?? poseOf(node));
        yield {node, matrix};
        left.push(...(node.children ?? []).map((child) => [child, matrix]));
    }
}

/** The middle of all that has a shape, from the bounds that the file tells. */
function middleOf(tree) {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (const {node, matrix} of nodesOf(tree)) {
        for (const {attributes} of tree.meshes?.[node.mesh]?.primitives ?? []) {
            const {min, max} = tree.accessors[attributes.POSITION];
            for (let corner = 0; corner < 8; corner++) {
                const at = transform(matrix, [0, 1, 2].map((axis) => (corner >> axis & 1 ? max : min)[axis]));
                at.forEach((value, axis) => {
                    low[axis] = Math.min(low[axis], value);
                    high[axis] = Math.max(high[axis], value);
                });
            }
        }
    }
    return low[0] <= high[0] ? low.map((value, axis) => (value + high[axis]) / 2) : [0, 0, 0];
}

/** Remembers the perspective cameras of a GLB under its hash. */
export async function rememberCameras(file, hash) {
    const tree = await treeOf(file);
    const middle = middleOf(tree);
    const cameras = [...nodesOf(tree)].filter(({node}) => tree.cameras?.[node.camera]?.perspective).map(({node, matrix}) => ({
        names: [tree.cameras[node.camera].name, node.name],
        position: transform(matrix, [0, 0, 0]),
        forward: normalize(scale(turn(matrix, [0, 0, 1]), -1)),
        up: normalize(turn(matrix, [0, 1, 0])),
        yfov: tree.cameras[node.camera].perspective.yfov,
        middle,
    }));
    localStorage.setItem(KEY + hash, JSON.stringify(cameras));
}

/** The parts of a camera that a scene leaves to its glTF file; null when that file is not known here. */
export function cameraOf(scene) {
    for (const object of scene.objects ?? []) {
        const text = object.type === "gltf" && localStorage.getItem(KEY + object.asset.replace("sha256:", ""));
        if (!text)
            continue;
        const cameras = JSON.parse(text);
        const {from} = scene.camera ?? {};
        const found = from ? cameras.find(({names}) => names.includes(from)) : cameras[0];
        return found ? viewFrom(found, scene.image) : from ? null : {position: [0, 2, 10], look_at: [0, 0, 0], up: [0, 1, 0], horizontal_fov: 50};
    }
    return null;
}

/** Looks as the file's camera does, and turns about what lies as deep as the middle of the model. */
function viewFrom({position, forward, up, yfov, middle}, {width, height}) {
    const depth = Math.max(1e-3, dot(subtract(middle, position), forward));
    return {
        position, up, look_at: position.map((value, axis) => value + depth * forward[axis]),
        horizontal_fov: 360 / Math.PI * Math.atan(Math.tan(yfov / 2) * width / height),
    };
}
