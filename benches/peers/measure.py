"""What all peers share: their options, how they are timed, and what they print."""

import argparse
import json
import time
from pathlib import Path

from PIL import Image


def options():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path, help="what `chaic bench scene --out` wrote")
    parser.add_argument("--seconds", type=float, default=10.0, help="measure at least so long")
    return parser.parse_args()


def measure(name, channels, version, draw, cameras, seconds):
    """Draws all cameras in turn until the time is up, after one round that doesn't count, and
    prints what a picture cost. `draw` takes a camera's index."""
    for k in range(len(cameras)):
        draw(k)
    frames, wall, cpu = 0, time.perf_counter(), time.process_time()
    while time.perf_counter() - wall < seconds:
        for k in range(len(cameras)):
            draw(k)
        frames += len(cameras)
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    print(
        json.dumps(
            {
                "name": name,
                "channels": channels,
                "version": version,
                "size": cameras[0].height,
                "frames": frames,
                "cpu_ms_per_frame": 1e3 * cpu / frames,
                "ms_per_frame": 1e3 * wall / frames,
            }
        ),
        flush=True,
    )


def save(rgb, folder, name):
    """Keeps what the first camera sees, to be looked at: uint8 [height, width, 3]."""
    Image.fromarray(rgb).save(folder / f"{name}.png")
