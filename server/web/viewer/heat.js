// SPDX-License-Identifier: Apache-2.0
// Grey to heat: how many samples each pixel took.

// Stops of a scale whose lightness rises evenly (after "inferno", van der Walt and Smith 2015).
const STOPS = [[0, 0, 4], [40, 11, 84], [101, 21, 110], [159, 42, 99], [212, 72, 66], [245, 125, 21], [250, 193, 39], [252, 255, 164]];

function table() {
    const colors = new Uint8ClampedArray(256 * 3);
    for (let i = 0; i < 256; i++) {
        const at = i / 255 * (STOPS.length - 1), low = Math.min(Math.floor(at), STOPS.length - 2);
        for (let c = 0; c < 3; c++)
            colors[3 * i + c] = STOPS[low][c] + (at - low) * (STOPS[low + 1][c] - STOPS[low][c]);
    }
    return colors;
}

/** The bitmap of a grey layer in heat colours. */
export async function heat(bitmap) {
    const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
    const context = canvas.getContext("2d", {willReadFrequently: true});
    const colors = table();
    context.drawImage(bitmap, 0, 0);
    const image = context.getImageData(0, 0, bitmap.width, bitmap.height);
    for (let i = 0; i < image.data.length; i += 4)
        image.data.set(colors.subarray(3 * image.data[i], 3 * image.data[i] + 3), i);
    return createImageBitmap(image);
}
