// SPDX-License-Identifier: Apache-2.0
// What all scenarios rely on: that a violation of the policy, and an error, is seen.
export const allowed = /policy: script-src|policy: connect-src|policy: img-src|Content Security Policy|on purpose/;

export default async function ({page, url, faults}) {
    await page.goto(url);
    await page.waitForSelector("#farm-pill[data-state]");
    await page.evaluate(() => {
        const script = document.createElement("script");
        script.textContent = "window.ran = true";
        document.body.append(script);
        fetch("http://192.0.2.1/").catch(() => {});
        new Image().src = "http://192.0.2.1/";
        setTimeout(() => { throw new Error("on purpose"); });
    });
    await page.waitForTimeout(300);
    const missing = ["script-src", "connect-src", "img-src", "on purpose"].filter((word) => !faults.some((fault) => fault.includes(word)));
    if (missing.length > 0 || await page.evaluate(() => window.ran))
        throw new Error(`not seen: ${missing}`);
}
