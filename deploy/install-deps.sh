#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Installs the Debian 12 packages that Penumbra is built with and runs on; with --tests also those
# that its tests and checks need, with --bench those that it is measured against. Quick when nothing
# is missing. Runs as root or through sudo.
set -euo pipefail

packages=(
    cmake ninja-build pkgconf   # the build
    g++                         # C11 (gcc comes along), C++ shims around OpenImageIO and tinygltf
    libembree-dev               # ray traversal
    libopenimageio-dev          # PNG, JPEG, EXR and HDR files
    libtinygltf-dev             # glTF's text
    nlohmann-json3-dev          # which tinygltf reads it with
    libjansson-dev              # JSON of scenes and answers
    libmicrohttpd-dev           # the HTTP interface
    libuv1-dev                  # event loops of coordinator and worker
    libprotobuf-c-dev           # messages of the tile protocol
    protobuf-c-compiler         # protoc-c, which makes their code
    libsqlite3-dev              # the store of jobs and tiles
    libxxhash-dev               # checksums of frames and tiles
    libgnutls28-dev             # TLS of HTTP and of workers, certificates, SHA-256
    libseccomp-dev              # the sandbox of encoder and scene processes
    libcurl4-gnutls-dev         # the command-line client
    libsystemd-dev              # readiness, watchdog and sockets of a service manager
)

test_packages=(
    git                         # the lint tests ask it for the tree's files
    python3 python3-pytest      # end-to-end, statistical and lint tests
    python3-numpy               # images and closed forms in the tests
    python3-jsonschema          # the schema of the scene format against the parser
    python3-openimageio         # reads back what the program wrote
    assimp-testmodels           # glTF files, good and broken, that are not ours
    libcmocka-dev               # unit tests in C
    curl                        # README's walk-through, and a client that is not ours
    procps                      # the tests look at processes
    iproute2                    # network namespaces for workers on spoiled wires
    valgrind libc6-dbg          # memory checks of the coordinator
    wrk                         # load of many pollers
    slowhttptest                # clients that never get done
    clang libclang-rt-14-dev    # the second compiler, and its sanitizers
    clang-format clang-tidy     # format and static checks
    cppcheck                    # static checks
    shellcheck                  # scripts
    strace                      # what scenes' names make a farm open
    spin                        # searches the model of leases and commits
    mandoc                      # manual pages
    chromium                    # the web page, used in a real browser
    nodejs                      # drives it, and the linter of the interface; both come by npm ci
    debootstrap lintian systemd # packages, checked and installed; units, checked
    slurm-wlm munge             # a Slurm of two nodes, to start workers in
    nginx haproxy openssl       # the examples of proxies, with keys
    prometheus                  # promtool, for rules
    python3-yaml                # rules and manifests
)

# A nodejs from elsewhere brings its own npm, and Debian's does not install beside it.
command -v npm >/dev/null || test_packages+=(npm)

bench_packages=(
    blender                     # Cycles, the path tracer to compare with
    povray                      # the other one
)

usage() {
    echo "usage: deploy/install-deps.sh [--tests] [--bench]"
}

for option in "$@"; do
    case $option in
        --tests) packages+=("${test_packages[@]}") ;;
        --bench) packages+=("${bench_packages[@]}") ;;
        --help) usage; exit 0 ;;
        *) usage >&2; exit 2 ;;
    esac
done

missing=()
for package in "${packages[@]}"; do
    status=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)
    [ "$status" = installed ] || missing+=("$package")
done
[ ${#missing[@]} -gt 0 ] || exit 0

as_root=()
if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || { echo "install-deps: run as root, or install sudo" >&2; exit 1; }
    as_root=(sudo)
fi

apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -y)
echo "install-deps: installing ${missing[*]}"
"${apt[@]}" update
"${apt[@]}" install --no-install-recommends "${missing[@]}"
