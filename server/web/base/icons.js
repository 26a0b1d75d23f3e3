// SPDX-License-Identifier: Apache-2.0
// Paths of 16 by 16 icons, stroked.

export const ICONS = {
    add: "M8 3v10M3 8h10",
    back: "M10 3 5 8l5 5",
    cancel: "M4 4l8 8M12 4l-8 8",
    pause: "M5.5 3.5v9M10.5 3.5v9",
    play: "M5 3.2v9.6L12.5 8z",
    remove: "M3 4.5h10M6.5 4.5V3h3v1.5M4.5 4.5l.6 8.5h5.8l.6-8.5M6.8 7v3.5M9.2 7v3.5",
    download: "M8 2.5v7.5M4.8 7 8 10.2 11.2 7M3 13h10",
    orbit: "M8 5.8a2.2 2.2 0 1 0 0 4.4 2.2 2.2 0 0 0 0-4.4M14 8c0 1.7-2.7 3-6 3s-6-1.3-6-3 2.7-3 6-3 6 1.3 6 3",
    hand: "M8 2v12M2 8h12M8 2 6.3 3.7M8 2l1.7 1.7M8 14l-1.7-1.7M8 14l1.7-1.7M2 8l1.7-1.7M2 8l1.7 1.7M14 8l-1.7-1.7M14 8l-1.7 1.7",
    fit: "M2.5 6V2.5H6M10 2.5h3.5V6M13.5 10v3.5H10M6 13.5H2.5V10",
    compare: "M8 2v12M2.5 4H6M2.5 12H6M2.5 4v8M10 4h3.5v8H10",
    reset: "M3.2 8a4.8 4.8 0 1 1 1.5 3.5M3 13v-2.2h2.3",
    camera: "M2.5 5h2.3l1-1.5h4.4l1 1.5h2.3v7.5h-11zM8 6.4a2.2 2.2 0 1 0 0 4.4 2.2 2.2 0 0 0 0-4.4",
    target: "M8 1.5v3M8 11.5v3M1.5 8h3M11.5 8h3M8 5a3 3 0 1 0 0 6 3 3 0 0 0 0-6",
};
