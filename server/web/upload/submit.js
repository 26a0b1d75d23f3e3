// SPDX-License-Identifier: Apache-2.0
import {sha256} from "../base/digest.js";
import {rememberCameras} from "../camera/model.js";
import {submitGlb, submitRender} from "../service/client.js";

/** Layers that the page can show beside the colour. */
const LAYERS = ["depth", "samples"];

/** "#rrggbb" as the linear numbers of the scene format. */
function linear(color) {
    return [1, 3, 5].map((at) => {
        const value = parseInt(color.slice(at, at + 2), 16) / 255;
        return Number((value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4).toPrecision(4));
    });
}

/** Posts what was dropped with the settings of the dialog; tells the render. */
export async function submit(found, settings) {
    if (found.kind === "glb") {
        await rememberCameras(found.file, await sha256(await found.file.arrayBuffer())).catch(() => {}); // if it is broken, the service says how
        return submitGlb(found.file, {
            name: settings.name, width: settings.width, height: settings.height, samples: settings.samples, mode: settings.mode,
            aovs: settings.layers ? LAYERS.join(",") : "", background: linear(settings.background).join(","),
        });
    }
    const image = {width: settings.width, height: settings.height};
    const sampling = {samples: settings.samples};
    if (settings.layers)
        image.aovs = [...new Set([...(found.scene.image?.aovs ?? []), ...LAYERS])];
    if (settings.mode)
        sampling.mode = settings.mode;
    return submitRender({
        scene: found.scene, override: {image, sampling}, options: {name: settings.name || undefined, priority: settings.priority},
    });
}
