#!/usr/bin/env bash
# Whether every row of the table (tests/table) is drawn with the same bits as at another commit, on this
# machine. Usage: scripts/compare-bits.sh OLD_COMMIT; ends with 1 where a row differs.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. scripts/setup.sh

[ $# -eq 1 ] || fail "expected a commit to compare with, found $# arguments; give one, such as HEAD~1"
commit=$(git rev-parse --verify --quiet "$1^{commit}") ||
    fail "expected a commit, found $1; see git log"
git cat-file -e "$commit:tests/table/main.rs" 2>/dev/null ||
    fail "expected tests/table in $1, found none; choose a later commit"

# One folder for both, so that dependencies are built once.
CARGO_TARGET_DIR=$(realpath -m "${CARGO_TARGET_DIR:-target}")
export CARGO_TARGET_DIR
folder=$CARGO_TARGET_DIR/bits
mkdir -p "$folder"
old=$folder/$commit.txt
new=$folder/new.txt

# bits SOURCE FILE: the bits of every row, drawn by the sources in a folder.
bits() {
    say "the rows of $1"
    rm -f "$2.part"
    (cd "$1" && VOXSPLAT_TABLE_BITS=$2.part cargo test --locked --quiet --test table -- bits_are_written >&2)
    [ -s "$2.part" ] || fail "expected bits of $1, found none; is there an adapter to draw with?"
    mv "$2.part" "$2"
}

if [ -s "$old" ]; then
    say "the rows of $1, as they were drawn before (remove $old to draw them anew)"
else
    tree=$(mktemp -d)
    trap 'git worktree remove --force "$tree/old" 2>/dev/null || true; rm -rf "$tree"' EXIT
    git worktree add --quiet --detach "$tree/old" "$commit"
    bits "$tree/old" "$old"
fi
bits "$PWD" "$new"

if diff "$old" "$new"; then
    say "$(grep -cv '^#' "$new") rows, the same bits as at $1"
else
    say "not the same bits as at $1 (<), found here (>)"
    exit 1
fi
