"""Options, timing and output of all peers."""

import argparse
import json
import time
from pathlib import Path

from PIL import Image


def options():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path, help="folder of `chaic bench scene --out`")
    parser.add_argument("--seconds", type=float, default=10.0, help="minimum duration")
    return parser.parse_args()


def measure(name, channels, version, draw, cameras, seconds):
    """Draws all cameras in turn for `seconds`, after one warm-up round, and prints the time per image.
    `draw` takes the index of a camera."""
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
    """Saves an image of the first camera for inspection: uint8 [height, width, 3]."""
    Image.fromarray(rgb).save(folder / f"{name}.png")
