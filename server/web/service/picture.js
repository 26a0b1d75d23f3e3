// SPDX-License-Identifier: Apache-2.0
// Addresses of a render's pictures that are no larger than a page can hold (IIIF Image API 3.0).

import {imagePath, renderPath} from "./client.js";

/** Images of more pixels are shown smaller, with their details where one looks. */
export const WHOLE_PIXELS_MAX = 1 << 23;

export function isLarge(render) {
    return render.width * render.height > WHOLE_PIXELS_MAX;
}

/** The whole image; of a large one a smaller picture, unless it is looked at in another way than plainly. */
export function wholePath(render, query, extension = "jpg") {
    if (!isLarge(render) || query.layer || query.exposure !== undefined)
        return imagePath(render.id, extension, query);
    const width = Math.floor(render.width * Math.sqrt(WHOLE_PIXELS_MAX / (render.width * render.height)));
    return `${renderPath(render.id)}/iiif/full/${width},/0/default.jpg`;
}

/** A region of the image, its sides divided by factor. */
export function regionPath(render, [x, y, width, height], factor) {
    return `${renderPath(render.id)}/iiif/${x},${y},${width},${height}/${Math.ceil(width / factor)},/0/default.jpg`;
}
