#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# linkage.sh PENUMBRA ENCODER: the coordinator loads neither the ray tracer nor the image library,
# directly (its dynamic section) or through another library (ldd). The encoder, which loads the
# second, proves that looking finds it.
set -eu

libraries() {
    readelf -d "$1" | grep NEEDED
    ldd "$1"
}

forbidden='libembree|libOpenImageIO|libOpenEXR|libtbb'
found=$(libraries "$1")
if echo "$found" | grep -E "$forbidden"; then
    echo "$1 must not load these" >&2
    exit 1
fi
libraries "$2" | grep -q libOpenImageIO || { echo "$2 should load libOpenImageIO" >&2; exit 1; }
