// SPDX-License-Identifier: Apache-2.0
// Turning a scene round: what is posted, what is seen, and what comes of it.
import {check, difference, openRender, waitLook} from "../page.mjs";

const status = (page, pattern) => page.waitForFunction(
    (source) => new RegExp(source).test(document.getElementById("camera-status").textContent), pattern);

async function quick(page, act) {
    await page.evaluate(() => { document.getElementById("camera-status").dataset.ms = ""; });
    await act();
    await page.waitForFunction(() => document.getElementById("camera-status").dataset.ms);
    return Number(await page.getAttribute("#camera-status", "data-ms"));
}

/** The milliseconds from a change to its image, for turns by keys one after the other. */
async function measure(page, turns) {
    const found = [];
    for (let i = 0; i < turns; i++)
        found.push(await quick(page, () => page.keyboard.press(i % 2 ? "ArrowRight" : "ArrowUp")));
    return found;
}

export default async function ({page, url, args: {render, turns}}) {
    const puts = [], posts = [];
    page.on("request", (request) => {
        if (request.method() === "PUT")
            puts.push(request.url());
        if (request.method() === "POST")
            posts.push(request.postDataJSON());
    });
    await openRender(page, url, render);
    const before = await waitLook(page, (look) => look.drawn === 1, "the image");
    await quick(page, () => page.click("#mode-camera"));
    await status(page, "settled");
    await page.focus("#viewport");
    const times = await measure(page, turns);
    await status(page, "settled");
    check(await difference(page, `/v1/renders/${render}/image.jpg`) > 1, "another view is another image");
    check(puts.length === 1, "the scene is sent once");
    check(posts.every(({scene, options}) => /^sha256:/.test(scene) && options.preview), "views are previews of the kept scene");
    check(posts.slice(1).every(({options}) => options.replaces), "each view replaces the one before");
    check(new Set(posts.map(({override}) => String(override.camera.position))).size > turns / 2, "the camera moves");

    const focus = await page.textContent("#focus-value");
    const box = await page.locator("#sheet").boundingBox();
    await quick(page, () => page.mouse.click(box.x + box.width / 2, box.y + box.height / 2));
    check(await page.textContent("#focus-value") !== focus, "a click focuses");
    await quick(page, () => page.fill("#aperture", "0.9"));
    check(posts.at(-1).override.camera.aperture_radius > 0, "the aperture opens");
    await quick(page, () => page.mouse.wheel(0, -300));

    await page.click("#render-view");
    await page.waitForFunction(() => document.getElementById("render-name").textContent.endsWith("(view)"));
    check(await page.isHidden("#camera-panel"), "the new render is looked at, not turned");
    const id = await page.textContent("#fact-id");
    const scene = await page.evaluate(async (path) => (await fetch(path)).json(), `/v1/renders/${id}/scene`);
    check(scene.camera.aperture_radius > 0, "it has the lens that was chosen");
    return {times, size: posts.at(-2).override.image, before};
}
