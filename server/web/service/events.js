// SPDX-License-Identifier: Apache-2.0

const AGAIN_MS = 1500;

/**
 * Follows a render: onTiles({frame, revision, tiles}), onProgress(progress), onDone(render or null).
 * When the stream breaks it begins anew, without a last event's id: a coordinator that was started
 * again counts its revisions from one, and tells what there is. Tells a function that ends it.
 */
export function follow(path, {onTiles, onProgress, onDone}) {
    let source = null;
    let timer = null;

    function open() {
        source = new EventSource(path);
        source.addEventListener("tiles", (event) => onTiles(JSON.parse(event.data)));
        source.addEventListener("progress", (event) => onProgress(JSON.parse(event.data)));
        source.addEventListener("done", (event) => {
            source.close();
            onDone(JSON.parse(event.data));
        });
        source.addEventListener("error", () => {
            source.close();
            timer = setTimeout(open, AGAIN_MS);
        });
    }

    open();
    return () => {
        clearTimeout(timer);
        source.close();
    };
}
