// SPDX-License-Identifier: Apache-2.0
// Tiles that arrive while one looks, and a render that is paused and cancelled from the page.
import {check, openRender, waitLook, waitState} from "../page.mjs";

const progress = (page) => page.evaluate(() => document.getElementById("render-progress").value);

/** Waits until something is drawn above the image, or nothing is. */
const waitMarked = (page, wanted) => page.waitForFunction((is) => {
    const canvas = document.getElementById("glow");
    const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d", {willReadFrequently: true});
    copy.drawImage(canvas, 0, 0);
    const {data} = copy.getImageData(0, 0, canvas.width, canvas.height);
    return data.some((value, i) => i % 4 === 3 && value > 0) === is;
}, wanted);

export default async function ({page, url, args}) {
    await openRender(page, url, args.render);
    await waitState(page, "Rendering");
    const first = await waitLook(page, (look) => look.drawn > 0 && look.mean > 5, "the first tiles");
    const before = await progress(page);
    await page.waitForFunction((value) => document.getElementById("render-progress").value > value, before);
    await waitLook(page, (look) => look.drawn > first.drawn || look.drawn > 0.999, "more tiles");
    await page.waitForFunction(() => /samples\/s/.test(document.getElementById("fact-rate").textContent));
    await page.waitForFunction(() => document.getElementById("fact-eta").textContent !== "–");

    await page.waitForFunction(() => document.querySelectorAll("#holders li").length === 1);
    check((await page.textContent("#holders")).includes(args.worker), "it says who is at work");
    check(await page.evaluate(() => document.getElementById("panel").scrollWidth <= document.getElementById("panel").clientWidth),
        "nothing of the panel is cut off");
    await page.emulateMedia({reducedMotion: "reduce"}); // no glow of tiles that have just come
    await waitMarked(page, true);
    await page.uncheck("#holders-shown");
    await waitMarked(page, false);
    await page.check("#holders-shown");
    await waitMarked(page, true);

    await page.click("#pause");
    await waitState(page, "Paused");
    await page.waitForFunction(() => document.getElementById("holders-panel").hidden);
    await waitMarked(page, false);
    await page.click("#resume");
    await waitState(page, "Rendering");
    await page.click("#cancel");
    await waitState(page, "Cancelled");
    check(await page.isHidden("#cancel"), "what is over cannot be cancelled");
    check((await page.textContent("#live")).includes("Cancelled"), "the end is announced");

    await page.click("#delete");
    await page.click("#delete-dialog button[value=delete]");
    await page.waitForFunction(() => location.hash === "#/");
    await page.waitForFunction((id) => !document.querySelector(`a.row[href$="${id}"]`), args.render);
}
