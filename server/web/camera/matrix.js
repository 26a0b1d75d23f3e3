// SPDX-License-Identifier: Apache-2.0
// Affine maps as glTF stores them: sixteen numbers, column by column.

/** a after b. */
export function multiply(a, b) {
    return Array.from({length: 16}, (_, i) => {
        const row = i % 4, column = i - row;
        return a[row] * b[column] + a[row + 4] * b[column + 1] + a[row + 8] * b[column + 2] + a[row + 12] * b[column + 3];
    });
}

/** Of a node's translation, rotation (a quaternion) and scale. */
export function poseOf({translation: t = [0, 0, 0], rotation: [x, y, z, w] = [0, 0, 0, 1], scale: s = [1, 1, 1]}) {
    return [
        s[0] * (1 - 2 * (y * y + z * z)), s[0] * 2 * (x * y + z * w), s[0] * 2 * (x * z - y * w), 0,
        s[1] * 2 * (x * y - z * w), s[1] * (1 - 2 * (x * x + z * z)), s[1] * 2 * (y * z + x * w), 0,
        s[2] * 2 * (x * z + y * w), s[2] * 2 * (y * z - x * w), s[2] * (1 - 2 * (x * x + y * y)), 0,
        t[0], t[1], t[2], 1,
    ];
}

/** Of a direction. */
export function turn(m, [x, y, z]) {
    return [0, 1, 2].map((row) => m[row] * x + m[row + 4] * y + m[row + 8] * z);
}

/** Of a point. */
export function transform(m, point) {
    return turn(m, point).map((value, row) => value + m[row + 12]);
}
