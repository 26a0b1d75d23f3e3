// SPDX-License-Identifier: Apache-2.0
import {byId} from "../base/dom.js";
import {dolly, orbit, pan} from "./view.js";

const TURN = Math.PI; // for a drag over the whole viewport
const KEY_TURN = 4 * Math.PI / 180;
const KEY_PAN = 0.04;
const KEY_DOLLY = 0.9;
const WHEEL_STEP = 0.0012;

/**
 * The tool that moves a session's camera: dragging turns, with Shift or the right button it moves aside;
 * the wheel goes nearer. onPick(u, v) is a click on a point of the image, onKey(key) the keys F and R.
 */
export function cameraTool(session, zoom, onPick, onKey) {
    const viewport = byId("viewport");
    const turn = (yaw, pitch) => session.set(orbit(session.view, yaw, pitch));
    const move = (x, y) => session.set(pan(session.view, x, y));
    const go = (factor) => session.set(dolly(session.view, factor));

    return {
        drag(dx, dy, event) {
            if (event.shiftKey || event.buttons & 6)
                move(dx / viewport.clientWidth, dy / viewport.clientWidth);
            else
                turn(-dx / viewport.clientWidth * TURN, dy / viewport.clientHeight * TURN);
        },
        click(event) {
            const [u, v] = zoom.toImage(event.clientX, event.clientY);
            if (u >= 0 && u <= 1 && v >= 0 && v <= 1)
                onPick(u, v);
        },
        wheel: (event) => go(Math.exp(event.deltaY * WHEEL_STEP)),
        key(event) {
            const [x, y] = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}[event.key] ?? [0, 0];
            if (x || y)
                event.shiftKey ? move(-x * KEY_PAN, -y * -KEY_PAN) : turn(x * KEY_TURN, y * KEY_TURN);
            else if (["+", "="].includes(event.key))
                go(KEY_DOLLY);
            else if (event.key === "-")
                go(1 / KEY_DOLLY);
            else if (["f", "r"].includes(event.key))
                onKey(event.key);
            else
                return false;
            return true;
        },
    };
}
