// SPDX-License-Identifier: Apache-2.0
// Tiles that arrive while one looks, and a render that is paused and cancelled from the page.
import {check, openRender, waitLook, waitState} from "../page.mjs";

const progress = (page) => page.evaluate(() => document.getElementById("render-progress").value);

export default async function ({page, url, args}) {
    await openRender(page, url, args.render);
    await waitState(page, "Rendering");
    const first = await waitLook(page, (look) => look.drawn > 0 && look.mean > 5, "the first tiles");
    const before = await progress(page);
    await page.waitForFunction((value) => document.getElementById("render-progress").value > value, before);
    await waitLook(page, (look) => look.drawn > first.drawn || look.drawn > 0.999, "more tiles");
    await page.waitForFunction(() => /samples\/s/.test(document.getElementById("fact-rate").textContent));
    await page.waitForFunction(() => document.getElementById("fact-eta").textContent !== "–");

    await page.click("#pause");
    await waitState(page, "Paused");
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
