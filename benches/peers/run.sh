#!/bin/sh
# Draws the same scene from the same cameras with chaic and with other CPU renderers, one after the
# other on the same core, and prints the CPU time per image. If a peer cannot be installed or
# started, the table gives the reason.
#
# usage: benches/peers/run.sh [SIZE] [SECONDS]        (default: 512 pixels, 10 seconds each)
#
# Environment:
#   OUT      output folder (default: target/peers)
#   CHAIC    program to measure (default: built by cargo build --release)
#   PYTHON   Python interpreter of the virtual environment (default: python3)
#   CORE     core to use (default: 0)
#   MUJOCO_GL  egl or osmesa (default: egl; Debian: libegl1 libgl1-mesa-dri, or libosmesa6)
set -eu

SIZE=${1:-512}
SECONDS_EACH=${2:-10}
HERE=$(cd "$(dirname "$0")" && pwd)
ROOT=$(cd "$HERE/../.." && pwd)
OUT=${OUT:-$ROOT/target/peers}
CORE=${CORE:-0}
PYTHON=${PYTHON:-python3}
mkdir -p "$OUT"
OUT=$(cd "$OUT" && pwd)
rm -f "$OUT"/peer-* "$OUT"/chaic-*.json

if [ -z "${CHAIC:-}" ]; then
    (cd "$ROOT" && cargo build --release --quiet)
    CHAIC=$(cd "$ROOT" && cd "${CARGO_TARGET_DIR:-target}" && pwd)/release/chaic
fi
on_one_core() { taskset -c "$CORE" "$@"; }

"$CHAIC" bench scene --size "$SIZE" --out "$OUT"

for channels in rgb+depth+ids rgb depth+ids; do
    on_one_core "$CHAIC" bench render --size "$SIZE" --channels "$channels" --threads 1 \
        --seconds "$SECONDS_EACH" --format json > "$OUT/chaic-$channels.json"
done

VENV=$OUT/venv
[ -d "$VENV" ] || "$PYTHON" -m venv "$VENV"

export PYTHONDONTWRITEBYTECODE=1
# One thread each: Mesa's rasterizer, OpenMP and BLAS start more by default.
export LP_NUM_THREADS=1 OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
export MUJOCO_GL=${MUJOCO_GL:-egl} LIBGL_ALWAYS_SOFTWARE=1

peer() { # NAME PACKAGE...
    name=$1
    shift
    log=$OUT/peer-$name.log
    if ! "$VENV/bin/pip" install --quiet --only-binary :all: numpy pillow "$@" > "$log" 2>&1 ||
        ! on_one_core "$VENV/bin/python" "$HERE/peer_$name.py" "$OUT" \
            --seconds "$SECONDS_EACH" > "$OUT/peer-$name.jsonl" 2> "$log"; then
        grep -v '^ *$' "$log" | tail -n 1 > "$OUT/peer-$name.reason"
    fi
}
peer pybullet pybullet
peer mujoco mujoco
peer embree open3d-cpu

"$VENV/bin/python" "$HERE/table.py" "$OUT" | tee "$OUT/table.md"
