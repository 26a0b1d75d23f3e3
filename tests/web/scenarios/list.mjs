// SPDX-License-Identifier: Apache-2.0
// A list of so many renders that it comes in pages.
import {check} from "../page.mjs";

const rows = (page) => page.locator("#render-list li").count();

export default async function ({page, url, args: {count}}) {
    await page.goto(url);
    await page.waitForFunction(() => document.querySelectorAll("#render-list li").length >= 50);
    const first = await rows(page);
    check(first < count, "not all come at once");
    const start = Date.now();
    while (await rows(page) < count) {
        const shown = await rows(page);
        await page.evaluate(() => document.getElementById("more").scrollIntoView());
        await page.waitForFunction((before) => document.querySelectorAll("#render-list li").length > before, shown);
    }
    const loaded = Date.now() - start;
    await page.waitForSelector("#more", {state: "hidden"});
    check(new Set(await page.$$eval("#render-list a", (nodes) => nodes.map((node) => node.href))).size === count, "each once");
    const fetched = await page.evaluate(() => performance.getEntriesByType("resource").filter(({name}) => /image\.jpg/.test(name)).length);
    check(fetched < count, "pictures that nobody sees are not fetched");
    await page.focus("#render-list li:first-child a");
    await page.keyboard.press("ArrowDown");
    check(await page.evaluate(() => document.activeElement.matches("#render-list li:nth-child(2) a")), "down goes to the next row");
    await page.keyboard.press("Enter");
    await page.waitForSelector("#panel:not([hidden])");
    await page.selectOption("#state-filter", "failed");
    await page.waitForFunction(() => document.querySelectorAll("#render-list li").length === 0);
    await page.waitForSelector("#no-renders:not([hidden])");
    return {loaded};
}
