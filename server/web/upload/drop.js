// SPDX-License-Identifier: Apache-2.0
import {byId, isTyping} from "../base/dom.js";
import {notify} from "../base/announce.js";
import {readFiles, readScene} from "./dropped.js";

/** Takes what is dropped on the page, pasted into it or chosen, and hands it on as readFiles tells. */
export function takeFiles(onFound) {
    const found = (promise) => promise.then(onFound, (error) => notify(error.message, "fault"));
    let depth = 0;

    const lift = (by) => {
        depth = Math.max(0, depth + by);
        document.body.classList.toggle("dropping", depth > 0);
    };
    addEventListener("dragenter", (event) => { event.preventDefault(); lift(1); });
    addEventListener("dragleave", () => lift(-1));
    addEventListener("dragover", (event) => event.preventDefault());
    addEventListener("drop", (event) => {
        event.preventDefault();
        lift(-depth);
        if (event.dataTransfer.files.length > 0)
            found(readFiles([...event.dataTransfer.files]));
    });
    addEventListener("paste", (event) => {
        if (isTyping(event.target))
            return;
        const {files} = event.clipboardData;
        const text = event.clipboardData.getData("text/plain");
        if (files.length > 0)
            found(readFiles([...files]));
        else if (text.trim())
            found(readScene(text, [], "pasted scene"));
    });
    byId("file").addEventListener("change", (event) => {
        found(readFiles([...event.target.files]));
        event.target.value = "";
    });
    for (const button of document.querySelectorAll("[data-choose]"))
        button.addEventListener("click", () => byId("file").click());
}
