// SPDX-License-Identifier: Apache-2.0
// Puts the parts together: what is looked at stands in the address after "#".

import {byId, isTyping, setHidden} from "./base/dom.js";
import {notify} from "./base/announce.js";
import {nameOf} from "./base/format.js";
import {FarmView} from "./farm/view.js";
import {showStatus} from "./farm/status.js";
import {Details} from "./panel/details.js";
import {LookPanel} from "./panel/look.js";
import {RenderList} from "./renders/list.js";
import {RenderStore} from "./renders/store.js";
import {changeRender, getRender, removeRender} from "./service/client.js";
import {FarmWatch} from "./service/farm.js";
import {SubmitDialog} from "./upload/dialog.js";
import {takeFiles} from "./upload/drop.js";
import {Input, inspectTool} from "./viewer/input.js";
import {Viewer} from "./viewer/viewer.js";

const store = new RenderStore();
const watch = new FarmWatch();
const list = new RenderList(store);
const viewer = new Viewer();
const details = new Details();
const look = new LookPanel(store);
const farmView = new FarmView(watch);
const input = new Input();
const dialog = new SubmitDialog((render) => {
    store.put(render);
    location.hash = `#/renders/${render.id}`;
});

input.tool = inspectTool(viewer.zoom);

async function openRender(id) {
    let render;
    try {
        render = await getRender(id);
    } catch (refusal) {
        viewer.close();
        setHidden(byId("panel"), true);
        viewer.say(refusal.status ? refusal.message : "The service does not answer.");
        return;
    }
    look.start(render);
    viewer.look = {exposure: undefined, layer: ""};
    viewer.open(render);
    details.show(render);
    setHidden(byId("panel"), false);
    document.title = `${nameOf(render)} – Penumbra`;
}

function route() {
    const [, place, id] = location.hash.split("/");
    const isRender = place === "renders" && id;
    farmView.shown = place === "farm";
    setHidden(byId("viewer"), place === "farm");
    setHidden(byId("welcome"), Boolean(isRender) || place === "farm");
    setHidden(byId("toolbar"), !isRender);
    list.current = isRender ? id : null;
    document.title = place === "farm" ? "Farm – Penumbra" : "Penumbra";
    if (isRender) {
        void openRender(id);
    } else {
        viewer.close();
        setHidden(byId("panel"), true);
    }
}

/** Runs what a button asks for; what the service refuses is shown. */
async function act(work) {
    try {
        await work();
    } catch (refusal) {
        notify(refusal.status ? refusal.message : "The service does not answer.", "fault");
    }
}

const change = (state) => act(async () => {
    const render = await changeRender(viewer.render.id, {state});
    store.put(render);
    details.show(render);
});

const remove = () => act(async () => {
    const {render} = viewer;
    await removeRender(render.id);
    location.hash = "#/";
    store.drop(render.id);
    notify(`${nameOf(render)} was deleted.`);
});

viewer.addEventListener("render", ({detail}) => {
    details.show(detail);
    if (detail.links)
        store.put(detail);
});
viewer.addEventListener("refused", ({detail}) => {
    notify(detail.message, "fault");
    if (viewer.look.layer)
        look.showColor();
});
look.addEventListener("look", ({detail}) => viewer.setLook(detail));
look.addEventListener("compare", ({detail}) => act(() => viewer.compare(detail)));
watch.addEventListener("back", () => {
    void store.refresh();
    if (location.hash.startsWith("#/renders/"))
        route();
});
byId("pause").addEventListener("click", () => change("paused"));
byId("resume").addEventListener("click", () => change("running"));
byId("cancel").addEventListener("click", () => change("cancelled"));
byId("delete").addEventListener("click", () => byId("delete-dialog").showModal());
byId("delete-dialog").addEventListener("close", (event) => event.target.returnValue === "delete" && remove());
byId("zoom-fit").addEventListener("click", () => viewer.zoom.fit());
byId("zoom-actual").addEventListener("click", () => viewer.zoom.actual());
viewer.zoom.addEventListener("change", () => { byId("zoom-value").textContent = `${Math.round(viewer.zoom.scale * devicePixelRatio * 100)} %`; });
document.addEventListener("visibilitychange", () => document.hidden || store.refresh());
addEventListener("keydown", (event) => {
    if (event.key === "n" && !isTyping(event.target) && !event.ctrlKey && !event.metaKey)
        byId("file").click();
});
addEventListener("hashchange", route);

takeFiles((found) => dialog.open(found));
showStatus(watch);
watch.start();
void store.refresh();
route();
