// SPDX-License-Identifier: Apache-2.0
// Exposure, layers, before and after, zoom, downloads.
import {check, difference, openRender, waitLook} from "../page.mjs";

export const allowed = /status of 404/; // of the layer that there is not

async function zoomed(page) {
    const text = await page.textContent("#zoom-value");
    return parseFloat(text);
}

export default async function ({page, url, args: {render, other}}) {
    await openRender(page, url, render);
    const plain = await waitLook(page, (look) => look.drawn === 1 && look.mean > 10, "the image");
    await page.fill("#exposure", "2");
    await waitLook(page, (look) => look.mean > plain.mean * 1.2, "a brighter image");
    check(await page.textContent("#exposure-value") === "+2.0 EV", "the slider tells its stops");
    await page.click("#exposure-reset");
    await waitLook(page, (look) => Math.abs(look.mean - plain.mean) < 1, "the image as it was");

    await page.selectOption("#layer", "samples");
    await waitLook(page, (look) => look.spread > 20, "heat colours");
    check(await page.isVisible("#heat-legend"), "the heat map has a legend");
    await page.selectOption("#layer", "albedo");
    await page.waitForSelector(".toast.fault");
    await waitLook(page, (look) => Math.abs(look.mean - plain.mean) < 1, "colour, as there is no such layer");

    await page.focus("#compare-with");
    await page.selectOption("#compare-with", other);
    const handle = page.locator("#compare-handle");
    await handle.waitFor();
    const at = Number(await handle.getAttribute("aria-valuenow"));
    await handle.press("ArrowRight");
    check(Number(await handle.getAttribute("aria-valuenow")) === at + 2, "keys move the line");
    await page.selectOption("#compare-with", "");
    check(await handle.isHidden(), "nothing is compared any more");

    const viewport = page.locator("#viewport");
    const fitted = await zoomed(page);
    await viewport.press("+");
    check(await zoomed(page) > fitted, "plus magnifies");
    await page.mouse.move(600, 400);
    await page.mouse.wheel(0, 400);
    await page.waitForFunction((value) => parseFloat(document.getElementById("zoom-value").textContent) < value, fitted);
    await viewport.press("0");
    check(await zoomed(page) === fitted, "zero fits");

    const links = await page.$$eval("#downloads a", (nodes) => nodes.map((node) => [node.getAttribute("href"), node.download]));
    for (const [href, name] of links) {
        const answer = await page.request.get(url + href);
        check(answer.ok() && name.includes("."), `${href} as ${name}`);
    }
    check(links.length === 4, "PNG, EXR, JPEG, HDR");
    check(await difference(page, `/v1/renders/${render}/image.png`) < 3, "the canvas shows the image");
}
