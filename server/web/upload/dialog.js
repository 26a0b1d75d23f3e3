// SPDX-License-Identifier: Apache-2.0
import {byId, element, setHidden, setText} from "../base/dom.js";
import {submit} from "./submit.js";

/** Asks for the settings of a render of what was dropped, and posts it. */
export class SubmitDialog {
    #dialog = byId("submit-dialog");
    #form = byId("submit-form");
    #found = null;
    #onAccepted;

    constructor(onAccepted) {
        this.#onAccepted = onAccepted;
        this.#form.addEventListener("submit", (event) => {
            event.preventDefault();
            void this.#submit();
        });
        byId("submit-cancel").addEventListener("click", () => this.#dialog.close());
    }

    open(found) {
        const {scene} = found;
        const field = this.#form.elements;
        this.#found = found;
        setText(byId("submit-title"), found.kind === "glb" ? "Render a model" : "Render a scene");
        field.name.value = found.name;
        field.width.value = scene?.image?.width ?? 1280;
        field.height.value = scene?.image?.height ?? 720;
        field.samples.value = scene?.sampling?.samples ?? 64;
        field.mode.value = scene?.sampling?.mode ?? "uniform";
        for (const [part, shown] of [["glb-only", found.kind === "glb"], ["scene-only", found.kind !== "glb"]])
            for (const node of this.#form.querySelectorAll(`.${part}`))
                setHidden(node, !shown);
        this.#tell([]);
        this.#dialog.showModal();
    }

    async #submit() {
        const field = this.#form.elements;
        byId("submit-go").disabled = true;
        try {
            const render = await submit(this.#found, {
                name: field.name.value.trim(), width: field.width.valueAsNumber, height: field.height.valueAsNumber,
                samples: field.samples.valueAsNumber, mode: field.mode.value, background: field.background.value,
                layers: field.layers.checked, priority: field.priority.valueAsNumber,
            });
            this.#dialog.close();
            this.#onAccepted(render);
        } catch (refusal) {
            this.#tell([refusal.message, ...(refusal.faults ?? []).map(({pointer, detail}) => `${pointer}: ${detail}`)]);
        }
        byId("submit-go").disabled = false;
    }

    #tell(lines) {
        byId("submit-faults").replaceChildren(...lines.map((line) => element("li", {class: "fault"}, line)));
        setHidden(byId("submit-faults"), lines.length === 0);
    }
}
