// SPDX-License-Identifier: Apache-2.0
// What several scenarios do on the page.

export async function openRender(page, url, id) {
    await page.goto(`${url}/#/renders/${id}`);
    await page.waitForFunction((wanted) => document.getElementById("fact-id")?.textContent === wanted, id);
}

/** Drops a GLB, given in base64, on the page. */
export async function drop(page, glb) {
    await page.evaluate((base64) => {
        const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
        const dataTransfer = new DataTransfer();
        dataTransfer.items.add(new File([bytes], "model.glb"));
        dispatchEvent(new DragEvent("drop", {dataTransfer, cancelable: true}));
    }, glb);
}

/** Waits until the render that is shown is in a state, as the page says it. */
export async function waitState(page, state) {
    await page.waitForFunction((wanted) => document.getElementById("render-state")?.textContent === wanted, state);
}

/** Puts into the page what tells an image's or canvas's pixels. */
async function prepare(page) {
    await page.evaluate(() => {
        window.pixelsOf ??= (source, width, height) => {
            const context = new OffscreenCanvas(width, height).getContext("2d", {willReadFrequently: true});
            context.drawImage(source, 0, 0, width, height);
            return context.getImageData(0, 0, width, height).data;
        };
    });
}

/** What the canvas shows: mean of the colours (0 to 255), how far apart red and blue are, the share that is drawn. */
export async function look(page) {
    await prepare(page);
    return page.evaluate(() => {
        const canvas = document.getElementById("canvas");
        const data = window.pixelsOf(canvas, canvas.width, canvas.height);
        let sum = 0, spread = 0, drawn = 0;
        for (let i = 0; i < data.length; i += 4) {
            sum += data[i] + data[i + 1] + data[i + 2];
            spread += Math.abs(data[i] - data[i + 2]);
            drawn += data[i + 3] > 0;
        }
        const pixels = data.length / 4;
        return {mean: sum / pixels / 3, spread: spread / pixels, drawn: drawn / pixels};
    });
}

/** The mean difference (0 to 255) between the canvas and an image of the service. */
export async function difference(page, path) {
    await prepare(page);
    return page.evaluate(async (source) => {
        const canvas = document.getElementById("canvas");
        const other = await createImageBitmap(await (await fetch(source)).blob());
        const ours = window.pixelsOf(canvas, canvas.width, canvas.height);
        const theirs = window.pixelsOf(other, canvas.width, canvas.height);
        let sum = 0;
        for (let i = 0; i < ours.length; i++)
            sum += Math.abs(ours[i] - theirs[i]);
        return sum / ours.length;
    }, path);
}

/** Waits until a condition on look(page) holds; tells the look. */
export async function waitLook(page, condition, what) {
    const end = Date.now() + 30000;
    for (;;) {
        const found = await look(page);
        if (condition(found))
            return found;
        if (Date.now() > end)
            throw new Error(`${what}: ${JSON.stringify(found)}`);
        await page.waitForTimeout(50);
    }
}

export function check(condition, what) {
    if (!condition)
        throw new Error(what);
}
