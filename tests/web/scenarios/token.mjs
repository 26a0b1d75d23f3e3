// SPDX-License-Identifier: Apache-2.0
// A service that asks for a token: the page asks for it, and does all that it does without one.
import {check, waitLook, waitState} from "../page.mjs";

export const allowed = /status of 401/;

async function enter(page, token) {
    await page.waitForSelector("#token-dialog[open]");
    await page.fill("#token-form input", token);
    await page.click("#token-form button");
}

export default async function ({page, url, args: {token, render, live}}) {
    await page.goto(`${url}/#/renders/${live}`);
    await enter(page, "pnb_wrong");
    await page.waitForSelector("#token-fault:not([hidden])");
    await enter(page, token);
    await page.waitForSelector("#farm-pill[data-state=ready]");
    await page.waitForFunction((id) => document.getElementById("fact-id")?.textContent === id, live);
    check(await page.isHidden("#token-dialog"), "it asks once");
    check(!page.url().includes(token), "the token is not in the address");
    await waitState(page, "Rendering");
    const first = await waitLook(page, (look) => look.drawn > 0, "the first tiles");
    await waitLook(page, (look) => look.drawn > first.drawn || look.drawn > 0.999, "more tiles");
    await page.click("#cancel");
    await waitState(page, "Cancelled");
    await page.goto(`${url}/#/renders/${render}`);
    await waitState(page, "Done");
    const picture = `a.row[href$="${render}"] img`;
    await page.waitForFunction((where) => document.querySelector(where)?.naturalWidth > 0, picture);
    const [download] = await Promise.all([page.waitForEvent("download"), page.click("[data-extension=exr]")]);
    check(download.suggestedFilename().endsWith(".exr"), download.suggestedFilename());
    check(await download.failure() === null, "the file is saved");
    check(await page.evaluate(() => document.cookie === "" && localStorage.length === 0), "it is kept in this tab only");
}
