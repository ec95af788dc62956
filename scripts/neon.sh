#!/usr/bin/env bash
# Draws a few scenes with NEON, on an emulated 64-bit ARM, and compares the pictures with this machine's: a smoke test of
# half an hour, most of it building. Its times mean nothing. Debian and Ubuntu, as root.
set -euo pipefail
cd "$(dirname "$0")/.."
apt-get install -y --no-install-recommends gcc-aarch64-linux-gnu g++-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user-static
target=aarch64-unknown-linux-gnu
rustup target add "$target"
CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc cargo build --target "$target"
cargo build
folder=${CARGO_TARGET_DIR:-target}
pictures=$(mktemp -d)
trap 'rm -r "$pictures"' EXIT
failed=0
compare() {
    local there="$pictures/there.png" here="$pictures/here.png" stats="$pictures/stats.json"
    qemu-aarch64-static -L /usr/aarch64-linux-gnu "$folder/$target/debug/voxsplat" \
        render "$@" --engine native --resolution 96,64 --output "$there" --stats "$stats"
    "$folder/debug/voxsplat" render "$@" --engine native --resolution 96,64 --output "$here"
    if grep -q '"adapter": "native (NEON' "$stats" && cmp "$there" "$here"; then
        echo "the same bytes: $*"
    else
        echo "not the same, or not by NEON: $*"
        failed=1
    fi
}
compare demo:shells:24
compare demo:shells:24 --visibility sheets --classify before
compare demo:head:32 --shading lights
compare demo:tornado:16
compare demo:tornado:16 --vectors-only
exit "$failed"
