// SPDX-License-Identifier: Apache-2.0
// Elements without markup: what comes from elsewhere becomes text, never HTML.

const SVG = "http://www.w3.org/2000/svg";

function assign(node, name, value) {
    if (value === undefined || value === null || value === false)
        return;
    if (name.startsWith("on"))
        node.addEventListener(name.slice(2), value);
    else if (name in node && typeof value !== "string")
        node[name] = value;
    else
        node.setAttribute(name, value === true ? "" : value);
}

/** A new element; attributes named on… are listeners, children are nodes or text. */
export function element(tag, attributes = {}, ...children) {
    const node = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes))
        assign(node, name, value);
    node.append(...children.flat().filter((child) => child !== null && child !== undefined && child !== false));
    return node;
}

/** An icon of one path, hidden from screen readers: what it means is said in words beside it. */
export function icon(path) {
    const svg = document.createElementNS(SVG, "svg");
    svg.setAttribute("viewBox", "0 0 16 16");
    svg.setAttribute("class", "icon");
    svg.setAttribute("aria-hidden", "true");
    const shape = document.createElementNS(SVG, "path");
    shape.setAttribute("d", path);
    svg.append(shape);
    return svg;
}

export function byId(id) {
    return document.getElementById(id);
}

/** Sets the text only when it differs, so that selections and screen readers are left alone. */
export function setText(node, text) {
    if (node.textContent !== text)
        node.textContent = text;
}

export function setHidden(node, hidden) {
    if (node.hidden !== hidden)
        node.hidden = hidden;
}

/** Whether keys typed there belong to a field and not to the page. */
export function isTyping(target) {
    return target.closest("input:not([type=range]):not([type=checkbox]), textarea, select, dialog") !== null;
}
