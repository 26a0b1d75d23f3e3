// SPDX-License-Identifier: Apache-2.0
// From a file to a finished image, and what a scene with a fault is answered.
import {check, difference, waitState} from "../page.mjs";

export const allowed = /status of 400/; // which is what the faulty scene gets

export default async function ({page, url, args}) {
    await page.goto(url);
    await page.setInputFiles("#file", {name: "broken.json", mimeType: "application/json", buffer: Buffer.from(args.broken)});
    await page.click("#submit-go");
    await page.waitForSelector("#submit-faults li:has-text('/objects/0/radius')");
    await page.click("#submit-cancel");

    await page.setInputFiles("#file", {name: "ball <b>.json", mimeType: "application/json", buffer: Buffer.from(args.scene)});
    await page.waitForSelector("#submit-dialog[open]");
    check(await page.inputValue("[name=name]") === "ball <b>", "the name comes from the file");
    await page.click("#submit-go");
    await waitState(page, "Done");
    check(await page.textContent("#render-name") === "ball <b>", "a name is text, not markup");
    const id = await page.textContent("#fact-id");
    await page.waitForFunction(() => document.querySelector("a.row[aria-current] .row-state").textContent === "Done");
    await page.waitForTimeout(200);
    check(await difference(page, `/v1/renders/${id}/image.png`) < 3, "the canvas shows the final image");
    return id;
}
