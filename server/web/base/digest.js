// SPDX-License-Identifier: Apache-2.0

/** The SHA-256 of bytes, as the service writes it. */
export async function sha256(bytes) {
    const digest = await crypto.subtle.digest("SHA-256", bytes);
    return [...new Uint8Array(digest)].map((byte) => byte.toString(16).padStart(2, "0")).join("");
}
