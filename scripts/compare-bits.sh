#!/usr/bin/env bash
# Draws the table of scenes and modes (tests/table) at another commit and here, on this machine, and compares the bits
# of every row that both have:
#   scripts/compare-bits.sh COMMIT
# Prints the rows that differ, and exits with 1 where there are any.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
if [ $# -ne 1 ]; then
    echo "usage: scripts/compare-bits.sh COMMIT" >&2
    exit 2
fi

work=$(mktemp -d)
trap 'git worktree remove --force "$work/there" 2>/dev/null || true; rm -rf "$work"' EXIT
git worktree add --quiet --detach "$work/there" "$1"

# bits FOLDER FILE: what is compiled in one folder is of no use in another, but for dependencies.
bits() {
    (cd "$1" && VOXSPLAT_TABLE_BITS="$2" \
        CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$OLDPWD/target}" \
        cargo test --locked --test table bits_are_written >"$2.log" 2>&1) ||
        { tail -n 30 "$2.log" >&2; exit 1; }
}
bits "$work/there" "$work/there.txt"
bits . "$work/here.txt"

# A row is its name, a colon, and its bits or why it was refused.
awk '
    /^#/ { next }
    { at = index($0, ": "); name = substr($0, 1, at - 1); found = substr($0, at + 2) }
    NR == FNR { there[name] = found; next }
    { total++ }
    name in there {
        both++
        if (there[name] != found) {
            print name; print "  there: " there[name]; print "  here:  " found; differ++
        }
    }
    END {
        printf "%d of %d rows are in both; %d differ\n", both, total, differ
        exit both == 0 || differ > 0
    }
' "$work/there.txt" "$work/here.txt"
