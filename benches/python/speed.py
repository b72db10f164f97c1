"""Measures steps per second from Python: random helpers and rule-based partners of all eight tasks.

    python benches/python/speed.py [--worlds 64] [--seconds 20]
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np

import chaic
from chaic.gym import HelperEnv
from chaic.vector import HelperVectorEnv


def vector_rate(worlds: int, seconds: float, **options: Any) -> float:
    """Returns the helpers' decisions per second over all worlds."""
    env = HelperVectorEnv(None, worlds, autoreset_mode="SameStep", **options)
    env.reset(seed=0)
    rng = np.random.default_rng(0)
    size = env.single_action_space.nvec
    decisions, start = 0, time.perf_counter()
    while time.perf_counter() - start < seconds:
        env.step(rng.integers(0, size, (worlds, 3)))
        decisions += worlds
    return decisions / (time.perf_counter() - start)


def single_rate(seconds: float, **options: Any) -> float:
    """Returns the decisions per second of one world with the Gymnasium interface."""
    env = HelperEnv(None, **options)
    env.reset(seed=0)
    rng = np.random.default_rng(0)
    size = env.action_space.nvec
    decisions, start = 0, time.perf_counter()
    while time.perf_counter() - start < seconds:
        *_, terminated, truncated, _ = env.step(rng.integers(0, size))
        decisions += 1
        if terminated or truncated:
            env.reset()
    return decisions / (time.perf_counter() - start)


def overhead_us(decisions: int = 4000) -> tuple[float, float]:
    """Returns the microseconds of a short step with the Gymnasium interface and with the world alone.

    Both take turns on the same world. The value is the tenth percentile: in these steps only the helper acts."""
    env = HelperEnv("low_target", observation="proprioception", partner_image_size=16)
    episode = {"episode": "low_target/train/00"}
    env.reset(seed=0, options=episode)
    world = env.world
    assert world is not None
    times: tuple[list[float], list[float]] = ([], [])
    for k in range(2 * decisions):
        if not world.waiting():
            env.reset(options=episode)
        start = time.perf_counter()
        if k % 2:
            world.step("turn_left")
        else:
            env.step([1, 0, 0])
        times[k % 2].append(time.perf_counter() - start)
    gymnasium_us, world_us = (1e6 * float(np.percentile(t, 10)) for t in times)
    return gymnasium_us, world_us


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--worlds", type=int, default=64)
    parser.add_argument("--seconds", type=float, default=20.0)
    arguments = parser.parse_args()
    worlds, seconds = arguments.worlds, arguments.seconds
    print(f"chaic {chaic.__version__}, {worlds} worlds of all eight tasks, {seconds:g} s each")
    for name, options in [
        ("color and depth, 128x128", {"observation": ("rgb", "depth", "proprioception")}),
        ("own state only", {"observation": "proprioception"}),
    ]:
        for eyes, more in [("512", {}), ("128", {"partner_image_size": 128})]:
            rate = vector_rate(worlds, seconds, **options, **more)
            print(f"vector, {name}, partners see {eyes} pixels: {rate:.0f} decisions/s")
        print(f"single, {name}: {single_rate(seconds / 2, **options):.0f} decisions/s")
    step, within = overhead_us()
    print(f"short step: {step:.0f} us, of which the world takes {within:.0f} us")


if __name__ == "__main__":
    main()
