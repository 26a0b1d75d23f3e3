// SPDX-License-Identifier: Apache-2.0
// Server-sent events, read by fetch: an EventSource shows no token.

import {ask} from "./client.js";

const AGAIN_MS = 1500;

/** Calls take(name, data) for each event of a stream's text, and keeps the rest of it. */
class Parser {
    #rest = "";

    constructor(take) {
        this.take = take;
    }

    add(text) {
        const blocks = (this.#rest + text).split("\n\n");
        this.#rest = blocks.pop();
        for (const block of blocks) {
            const fields = block.split("\n").map((line) => line.split(/: ?(.*)/s));
            const data = fields.filter(([name]) => name === "data").map(([, value]) => value);
            const name = fields.findLast(([field]) => field === "event")?.[1] ?? "message";
            if (data.length > 0)
                this.take(name, JSON.parse(data.join("\n")));
        }
    }
}

async function read(path, signal, take) {
    const parser = new Parser(take);
    const answer = await ask("GET", path, {signal, headers: {Accept: "text/event-stream"}});
    const reader = answer.body.pipeThrough(new TextDecoderStream()).getReader();
    for (let part = await reader.read(); !part.done; part = await reader.read())
        parser.add(part.value);
}

/**
 * Follows a render: onTiles({frame, revision, tiles}), onHeld({workers}), onProgress(progress),
 * onDone(render or null).
 * When the stream breaks it begins anew, without a last event's id: a coordinator that was started
 * again counts its revisions from one, and tells what there is. Tells a function that ends it.
 */
export function follow(path, {onTiles, onHeld, onProgress, onDone}) {
    const end = new AbortController();
    const takers = {tiles: onTiles, held: onHeld, progress: onProgress, done: (render) => {
        end.abort();
        onDone(render);
    }};
    let timer = null;

    async function open() {
        try {
            await read(path, end.signal, (name, data) => takers[name]?.(data));
        } catch {
            // Whatever it was, it is tried again.
        }
        if (!end.signal.aborted)
            timer = setTimeout(open, AGAIN_MS);
    }

    void open();
    return () => {
        clearTimeout(timer);
        end.abort();
    };
}
