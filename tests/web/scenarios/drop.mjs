// SPDX-License-Identifier: Apache-2.0
// The page, a GLB dropped on it with everything as the page proposes, and its image.
import {drop, waitState} from "../page.mjs";

export default async function ({page, url, args}) {
    await page.goto(url);
    await drop(page, args.glb);
    await page.waitForSelector("#submit-dialog[open]");
    await page.click("#submit-go");
    await waitState(page, "Done");
}
