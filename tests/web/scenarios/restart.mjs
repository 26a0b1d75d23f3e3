// SPDX-License-Identifier: Apache-2.0
// The service is stopped and started again while the page is open.
import {check, difference, openRender, waitState} from "../page.mjs";

export const allowed = /ERR_CONNECTION|ERR_EMPTY|ERR_INCOMPLETE|ERR_NETWORK|status of 503/;

export default async function ({page, url, args: {render}, call}) {
    await openRender(page, url, render);
    await waitState(page, "Rendering");
    await call("stop");
    await page.waitForSelector("#offline:not([hidden])");
    await call("start");
    await page.waitForSelector("#offline", {state: "hidden"});
    const before = await page.evaluate(() => document.getElementById("render-progress").value);
    await page.waitForFunction((value) => document.getElementById("render-progress").value > value, before);
    await page.click("#cancel");
    await waitState(page, "Cancelled");
    await page.waitForTimeout(500);
    check(await difference(page, `/v1/renders/${render}/image.png`) < 3, "the canvas shows what the service has");
}
