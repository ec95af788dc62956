#!/usr/bin/env bash
# What pictures cost on the graphics adapter of a machine, which may have neither Rust nor a network:
#   benches/gpu.sh build [FILE]      builds the program (here, FILE or benches/gpu-bench)
#   benches/gpu.sh run [FLAG…]       runs it (there), and writes benches/results/gpu-ADAPTER.md
#   benches/gpu.sh                   both
# Flags: --volumes 256,512,1024 --pictures 1920x1080,3840x2160 --output FILE
set -euo pipefail
cd "$(dirname "$0")/.."
program=benches/gpu-bench
build() {
    local built
    built=$(cargo bench --bench gpu --no-run --message-format=json |
        sed -n 's/.*"executable":"\([^"]*\/gpu-[0-9a-f]*\)".*/\1/p' | tail -1)
    strip -o "$1" "$built"
    echo "built: $1"
}
case "${1:-}" in
build) build "${2:-$program}" ;;
run) "./$program" "${@:2}" ;;
*)
    build "$program"
    "./$program" "$@"
    ;;
esac
