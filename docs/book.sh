#!/usr/bin/env bash
# Builds the book in book/, with live replays and a game: docs/book.sh, or with the path of the command: docs/book.sh
# target/debug/chaic. It needs mdbook. The pages in book/replays use no network and work from a disk.
set -euo pipefail
cd "$(dirname "$0")/.."
chaic=${1:-target/release/chaic}
[ -x "$chaic" ] || { echo "error: $chaic is missing; build it with: cargo build --release" >&2 && exit 1; }
chaic=$(realpath "$chaic")
replays=$PWD/book/replays
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

mdbook build
mkdir -p "$replays"
# Titles of the pages name the run's path.
cd "$work"
"$chaic" eval -q --task low_target,high_goal,obstacle --n-episodes 1 --helper none,rhp,infer --out benchmark
"$chaic" view benchmark --out "$replays/tasks.html"
"$chaic" view benchmark --helper rhp --out "$replays/rhp.html"
"$chaic" play low_target/test/00 --out "$replays/play.html"
