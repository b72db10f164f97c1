#!/usr/bin/env bash
# Builds the book in book/, with live replays and a game: docs/book.sh, or with the path of the command: docs/book.sh
# target/debug/chaic. It needs mdbook. The pages in book/replays use no network and work from a disk.
set -euo pipefail
cd "$(dirname "$0")/.."
chaic=${1:-target/release/chaic}
run=$(mktemp -d)
trap 'rm -rf "$run"' EXIT

mdbook build
mkdir -p book/replays
"$chaic" eval -q --task low_target,high_goal,obstacle --n-episodes 1 --helper none,rhp,infer --out "$run/run"
"$chaic" view "$run/run" --out book/replays/tasks.html
"$chaic" view "$run/run" --helper rhp --out book/replays/rhp.html
"$chaic" play low_target/test/00 --out book/replays/play.html
