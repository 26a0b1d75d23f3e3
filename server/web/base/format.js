// SPDX-License-Identifier: Apache-2.0
// Numbers and times for people.

/** 1234567 as "1.23 M". */
export function formatCount(value) {
    const units = ["", " k", " M", " G", " T", " P"];
    let power = 0;
    while (value >= 999.5 && power < units.length - 1) {
        value /= 1000;
        power++;
    }
    const digits = power === 0 || value >= 99.95 ? 0 : value >= 9.995 ? 1 : 2;
    return value.toFixed(digits) + units[power];
}

export function formatRate(samplesPerSecond) {
    return `${formatCount(samplesPerSecond)} samples/s`;
}

export function formatPercent(share) {
    return `${Math.floor(share * 100)} %`;
}

/** Seconds as "0.8 s", "12 s", "3 min 05 s", "2 h 10 min". */
export function formatDuration(seconds) {
    if (seconds < 9.95)
        return `${seconds.toFixed(1)} s`;
    const whole = Math.round(seconds);
    if (whole < 60)
        return `${whole} s`;
    if (whole < 3600)
        return `${Math.floor(whole / 60)} min ${String(whole % 60).padStart(2, "0")} s`;
    return `${Math.floor(whole / 3600)} h ${String(Math.floor(whole / 60) % 60).padStart(2, "0")} min`;
}

/** How long ago an instant of the service was, in a word. */
export function formatAge(instant, now = Date.now()) {
    const seconds = Math.max(0, (now - Date.parse(instant)) / 1000);
    if (seconds < 60)
        return "now";
    if (seconds < 3600)
        return `${Math.floor(seconds / 60)} min`;
    if (seconds < 86400)
        return `${Math.floor(seconds / 3600)} h`;
    return `${Math.floor(seconds / 86400)} d`;
}

/** At most digits significant ones, without trailing zeros. */
export function formatNumber(value, digits = 3) {
    return String(Number(value.toPrecision(digits)));
}

/** What a render is called: its name, or the beginning of its id. */
export function nameOf(render) {
    return render.name || `render ${render.id.slice(0, 6)}`;
}

const STATES = {
    queued: "Waiting", running: "Rendering", paused: "Paused", done: "Done", failed: "Failed", cancelled: "Cancelled",
};

export function stateOf(render) {
    return STATES[render.state] ?? render.state;
}

export function isOver(render) {
    return ["done", "failed", "cancelled"].includes(render.state);
}
