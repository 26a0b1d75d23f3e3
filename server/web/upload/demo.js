// SPDX-License-Identifier: Apache-2.0
import {ask} from "../service/client.js";
import {readScene} from "./dropped.js";

/** The demo scene that the service brings along, as if it had been dropped. */
export async function demoScene() {
    const answer = await ask("GET", "/web/demo.json");
    return readScene(await answer.text(), [], "Spiral");
}
