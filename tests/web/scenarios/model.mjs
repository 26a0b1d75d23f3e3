// SPDX-License-Identifier: Apache-2.0
// A GLB that is dropped, a scene that is pasted.
import {check, difference, drop, waitState} from "../page.mjs";

export default async function ({page, url, args}) {
    const posts = [];
    page.on("request", (request) => request.method() === "POST" && posts.push(request));
    await page.goto(url);
    await drop(page, args.glb);
    await page.waitForSelector("#submit-dialog[open]");
    await page.fill("[name=width]", "64");
    await page.fill("[name=height]", "48");
    await page.fill("[name=samples]", "4");
    await page.click("#submit-go");
    await waitState(page, "Done");
    check(await posts[0].headerValue("content-type") === "model/gltf-binary", "a GLB is posted as what it is");
    check(/name=model&width=64&height=48&samples=4/.test(posts[0].url()), posts[0].url());
    check(await page.textContent("#render-name") === "model", "its name is the file's");

    const id = await page.textContent("#fact-id");
    await page.click("#mode-camera");
    await page.waitForFunction(() => /settled/.test(document.getElementById("camera-status").textContent));
    const {camera} = posts.at(-1).postDataJSON().override;
    check(String(camera.position) === "0,0,3" && String(camera.look_at) === "0,0,0", "the first view is the file's camera");
    check(await difference(page, `/v1/renders/${id}/image.jpg`) < 2, "and looks like the render");
    await page.click("#mode-inspect");

    await page.evaluate((text) => {
        const clipboardData = new DataTransfer();
        clipboardData.setData("text/plain", text);
        document.body.dispatchEvent(new ClipboardEvent("paste", {clipboardData, bubbles: true}));
    }, args.scene);
    await page.waitForSelector("#submit-dialog[open]");
    await page.click("#submit-go");
    await page.waitForFunction(() => document.getElementById("render-name").textContent === "pasted scene");
    await waitState(page, "Done");
}
