// SPDX-License-Identifier: Apache-2.0
// What a camera sees, in the scene format's terms, and how it is moved. Views are never changed, only
// made anew.

import {cameraOf} from "./model.js";
import {add, cross, dot, length, normalize, rotate, scale, subtract} from "../base/vector.js";

const POLE = 0.02; // radians that stay between the view and straight up or down
const KEYS = ["position", "look_at", "up", "horizontal_fov", "aperture_radius", "focus_distance"];

/**
 * The view of a scene as the service tells it, with defaults; null when its camera lies in a glTF file
 * that is not known here.
 */
export function viewOf(scene) {
    let camera = scene.camera ?? {};
    if (!camera.position || camera.from) {
        const found = cameraOf(scene);
        if (!found)
            return null;
        camera = {aperture_radius: 0, focal_surface: "plane", focus_distance: distanceOf(found), ...found, ...camera};
    }
    const view = Object.fromEntries(KEYS.map((key) => [key, camera[key]]));
    view.focal_surface = camera.focal_surface;
    view.aspect = scene.image.width / scene.image.height;
    const key = camera.keyframes?.[0];
    return {...view, ...(key?.position && {position: key.position}), ...(key?.look_at && {look_at: key.look_at})};
}

/** The part of a merge patch that shows a view. */
export function overrideOf(view) {
    return {...Object.fromEntries(KEYS.map((key) => [key, view[key]])), from: null, keyframes: null};
}

export function distanceOf(view) {
    return length(subtract(view.position, view.look_at));
}

/** Unit vectors of the view: right, up as seen, forward. */
export function axesOf(view) {
    const forward = normalize(subtract(view.look_at, view.position));
    const right = normalize(cross(forward, view.up));
    return {right, up: cross(right, forward), forward};
}

/** Turns round what is looked at: yaw about the scene's up, pitch about the view's right, in radians. */
export function orbit(view, yaw, pitch) {
    const {right, forward} = axesOf(view);
    const up = normalize(view.up);
    const height = Math.asin(Math.min(1, Math.max(-1, -dot(forward, up))));
    const limit = Math.PI / 2 - POLE;
    const turned = Math.min(limit, Math.max(-limit, height + pitch)) - height;
    const arm = rotate(rotate(subtract(view.position, view.look_at), right, -turned), up, yaw);
    return {...view, position: add(view.look_at, arm)};
}

/** Moves aside, in parts of the image's width. */
export function pan(view, x, y) {
    const {right, up} = axesOf(view);
    const width = 2 * distanceOf(view) * Math.tan(view.horizontal_fov * Math.PI / 360);
    const step = add(scale(right, -x * width), scale(up, y * width));
    return {...view, position: add(view.position, step), look_at: add(view.look_at, step)};
}

/** Goes nearer or farther; what was in focus before the camera stays so. */
export function dolly(view, factor) {
    const before = distanceOf(view);
    const arm = scale(subtract(view.position, view.look_at), factor);
    const focus = view.focus_distance + before * (factor - 1);
    return {...view, position: add(view.look_at, arm), focus_distance: Math.max(focus, view.focus_distance * 0.05)};
}

/** The unit direction through a point of the image, in parts of its width and height. */
export function rayOf(view, u, v) {
    const {right, up, forward} = axesOf(view);
    const half = Math.tan(view.horizontal_fov * Math.PI / 360);
    return normalize(add(forward, add(scale(right, half * (2 * u - 1)), scale(up, half / view.aspect * (1 - 2 * v)))));
}

/** In focus at a point that lies so far along the ray through (u, v). */
export function focusAt(view, u, v, distance) {
    const along = view.focal_surface === "sphere" ? 1 : dot(rayOf(view, u, v), axesOf(view).forward);
    return {...view, focus_distance: distance * along};
}
