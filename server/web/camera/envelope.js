// SPDX-License-Identifier: Apache-2.0
// What is posted of a kept scene to see a view of it.

import {add, length} from "../base/vector.js";
import {overrideOf, rayOf} from "./view.js";

// Settings of other sampling modes than uniform go, whatever the scene has.
const PLAIN = {mode: "uniform", error: null, confidence: null, min_samples: null, threshold: null, pattern: null};

function preview(hash, override, priority, replaces) {
    return {scene: `sha256:${hash}`, override: {frames: null, ...override},
        options: {preview: true, priority, ...(replaces && {replaces})}};
}

/** The whole image of a size, with so many samples; replaces is the preview that it comes after. */
export function viewEnvelope(hash, view, {width, height, samples, priority}, replaces) {
    return preview(hash, {
        image: {width, height, crop: null, aovs: null}, camera: overrideOf(view), sampling: {...PLAIN, samples},
    }, priority, replaces);
}

/** One pixel with its depth, seen through a point of the image by a pinhole. */
export function probeEnvelope(hash, view, u, v, replaces) {
    const step = Math.max(1, length(view.position));
    const look_at = add(view.position, rayOf(view, u, v).map((part) => part * step));
    return preview(hash, {
        image: {width: 1, height: 1, crop: null, aovs: ["depth"], filter: {type: "box", width: 1}},
        camera: {...overrideOf(view), look_at, horizontal_fov: 0.02, aperture_radius: 0},
        sampling: {...PLAIN, samples: 1},
    }, 100, replaces);
}
