#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# From a fresh clone to a picture: installs the packages, builds, renders the demo scene on a farm
# of this machine's cores, and tells where the images are.
set -euo pipefail

cd "$(dirname "$0")/.."
out=build/demo

deploy/install-deps.sh
cmake --preset release
cmake --build --preset release -j "$(nproc)"

mkdir -p "$out"
build/release/bin/penumbra render deploy/demo/spiral.json -o "$out/spiral.png" -o "$out/spiral.exr"

# The first four bytes tell a PNG and an EXR from anything else.
starts_with() {
    [ "$(head -c 4 "$1" | od -An -tx1 | tr -d ' ')" = "$2" ] || {
        echo "demo: $1 is not what it should be" >&2
        exit 1
    }
}
starts_with "$out/spiral.png" 89504e47
starts_with "$out/spiral.exr" 762f3101

echo
echo "The demo's images:"
ls -l "$PWD/$out/spiral.png" "$PWD/$out/spiral.exr"
