// SPDX-License-Identifier: Apache-2.0
// An image that is too large to be held: its details come when one looks closely.
import {check, difference, openRender, waitLook} from "../page.mjs";

export default async function ({page, url, args: {render, width}}) {
    const asked = [];
    page.on("request", (request) => asked.push(request.url()));
    await openRender(page, url, render);
    await waitLook(page, (look) => look.mean > 1, "the image");
    const size = await page.evaluate(() => document.getElementById("canvas").width);
    check(size < width, "the canvas is smaller than the image");
    check(!asked.some((path) => /image\.jpg/.test(path)), "and the image is not fetched as a whole");
    check(await page.isHidden("#detail"), "from afar there are no details");
    check(await difference(page, `/v1/renders/${render}/iiif/full/${size},/0/default.jpg`) < 3, "it is the image");

    await page.focus("#viewport");
    for (let i = 0; i < 20 && await page.isHidden("#detail"); i++)
        await page.keyboard.press("+");
    await page.keyboard.press("1");
    await page.waitForFunction(() => {
        const canvas = document.getElementById("detail");
        const data = window.pixelsOf(canvas, 64, 64); // the middle of it is the ball and what is behind
        const middle = [...data.slice(4 * (32 * 64 + 30), 4 * (32 * 64 + 34))];
        return middle.every((value, i) => i % 4 !== 3 || value === 255) && middle.some((value, i) => i % 4 !== 3 && value > 20);
    });
    const regions = asked.filter((path) => /iiif\/\d+,\d+,\d+,\d+\/512,/.test(path));
    check(regions.length > 0 && regions.length < 20, `only what is seen is fetched: ${regions.length}`);
    await page.keyboard.press("0");
    await page.waitForSelector("#detail", {state: "hidden"});
}
