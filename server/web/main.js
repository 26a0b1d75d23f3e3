// SPDX-License-Identifier: Apache-2.0
// Puts the parts together: what is looked at stands in the address after "#".

import {byId, icon, isTyping, setHidden} from "./base/dom.js";
import {ICONS} from "./base/icons.js";
import {notify} from "./base/announce.js";
import {isOver, nameOf} from "./base/format.js";
import {askForToken} from "./access/dialog.js";
import {CameraMode} from "./camera/mode.js";
import {FarmView} from "./farm/view.js";
import {showStatus} from "./farm/status.js";
import {Details} from "./panel/details.js";
import {LookPanel} from "./panel/look.js";
import {RenderList} from "./renders/list.js";
import {RenderStore} from "./renders/store.js";
import {changeRender, getRender, removeRender} from "./service/client.js";
import {FarmWatch} from "./service/farm.js";
import {SubmitDialog} from "./upload/dialog.js";
import {demoScene} from "./upload/demo.js";
import {takeFiles} from "./upload/drop.js";
import {Input, inspectTool} from "./viewer/input.js";
import {Viewer} from "./viewer/viewer.js";

const store = new RenderStore();
const watch = new FarmWatch();
const list = new RenderList(store);
const viewer = new Viewer();
const camera = new CameraMode(viewer);
const details = new Details();
const look = new LookPanel(store);
const farmView = new FarmView(watch);
const input = new Input();
const dialog = new SubmitDialog(opened);

input.tool = inspectTool(viewer.zoom);

async function openRender(id) {
    let render;
    camera.leave();
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

/** A render that was just accepted. */
function opened(render) {
    if (isOver(render))
        notify("This has been rendered before: here it is.");
    store.put(render);
    location.hash = `#/renders/${render.id}`;
}

function setMode(isCamera) {
    byId("mode-camera").setAttribute("aria-pressed", String(isCamera));
    byId("mode-inspect").setAttribute("aria-pressed", String(!isCamera));
    input.tool = isCamera ? camera.tool : inspectTool(viewer.zoom);
    look.lockLayer(isCamera);
}

function inspect() {
    if (camera.session) {
        camera.leave();
        viewer.resume();
    }
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
        camera.leave();
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
look.addEventListener("look", ({detail}) => {
    viewer.setLook(detail);
    if (camera.session) {
        camera.session.exposure = detail.exposure;
        camera.refresh();
    }
});
look.addEventListener("compare", ({detail}) => act(() => viewer.compare(detail)));
watch.addEventListener("back", () => {
    void store.refresh();
    if (camera.session)
        camera.refresh();
    else if (location.hash.startsWith("#/renders/"))
        route();
});
byId("pause").addEventListener("click", () => change("paused"));
byId("resume").addEventListener("click", () => change("running"));
byId("cancel").addEventListener("click", () => change("cancelled"));
byId("delete").addEventListener("click", () => byId("delete-dialog").showModal());
byId("delete-dialog").addEventListener("close", (event) => event.target.returnValue === "delete" && remove());
byId("skip").addEventListener("click", (event) => {
    event.preventDefault();
    byId("viewport").focus();
});
byId("zoom-fit").addEventListener("click", () => viewer.zoom.fit());
byId("zoom-actual").addEventListener("click", () => viewer.zoom.actual());
viewer.zoom.addEventListener("change", () => { byId("zoom-value").textContent = `${Math.round(viewer.zoom.scale * devicePixelRatio * 100)} %`; });
camera.addEventListener("enter", () => setMode(true));
camera.addEventListener("leave", () => setMode(false));
camera.addEventListener("render", ({detail}) => opened(detail));
byId("mode-camera").addEventListener("click", () => camera.session || act(() => camera.enter(viewer.render)));
byId("mode-inspect").addEventListener("click", () => inspect());
document.addEventListener("visibilitychange", () => document.hidden || store.refresh());
addEventListener("keydown", (event) => {
    if (isTyping(event.target) || event.ctrlKey || event.metaKey || event.altKey)
        return;
    const button = {n: "choose", c: "mode-camera", v: "mode-inspect"}[event.key];
    if (button && !byId(button).closest("[hidden]"))
        byId(button).click();
});
addEventListener("hashchange", route);

for (const node of document.querySelectorAll("[data-icon]"))
    node.prepend(icon(ICONS[node.dataset.icon]));
byId("demo").addEventListener("click", () => act(async () => dialog.open(await demoScene())));
takeFiles((found) => dialog.open(found));
askForToken();
showStatus(watch);
watch.start();
void store.refresh();
route();
