// SPDX-License-Identifier: Apache-2.0
// Keyboard and screen reader: everything that takes the focus has a name, and Tab goes round in order.
import {check, openRender} from "../page.mjs";

export default async function ({page, url, args: {render}}) {
    await openRender(page, url, render);
    const nameless = await page.$$eval("a[href], button, input, select, [tabindex='0'], [role]", (nodes) => nodes
        .filter((node) => node.checkVisibility() && !node.closest("[aria-hidden=true]"))
        .filter((node) => !(node.getAttribute("aria-label") || node.textContent.trim() || node.labels?.length || node.title
            || document.getElementById(node.getAttribute("aria-labelledby")) || node.id === "live"))
        .map((node) => node.outerHTML));
    check(nameless.length === 0, nameless.join("\n"));

    await page.evaluate(() => document.activeElement.blur());
    await page.keyboard.press("Tab");
    check(await page.evaluate(() => document.activeElement.id) === "skip", "the first stop leads to the image");
    await page.keyboard.press("Enter");
    check(await page.evaluate(() => document.activeElement.id) === "viewport", "and does");
    check(await page.evaluate(() => location.hash).then((hash) => hash.startsWith("#/renders/")), "without leaving the render");
    const seen = [];
    for (let i = 0; i < 12; i++) {
        await page.keyboard.press("Tab");
        seen.push(await page.evaluate(() => document.activeElement.id));
    }
    const order = ["mode-inspect", "mode-camera", "zoom-fit", "delete", "exposure", "layer", "compare-with"];
    const places = order.map((id) => seen.indexOf(id));
    check(places.every((place, i) => place >= 0 && (i === 0 || place > places[i - 1])), seen.join(" "));
    await page.goto(`${url}/#/farm`);
    await page.waitForSelector("#farm-body tr");
    check((await page.textContent("#farm-why")).length > 0, "the farm says why work waits");
    const grounds = [];
    for (const colorScheme of ["light", "dark"]) {
        await page.emulateMedia({colorScheme});
        grounds.push(await page.evaluate(() => getComputedStyle(document.body).backgroundColor));
    }
    check(grounds[0] !== grounds[1], "light and dark differ");
}
