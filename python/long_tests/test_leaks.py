"""Memory of many episodes in one process, and a batch of many worlds."""

import resource
import sys

import numpy as np

import chaic
from chaic.gym import HelperEnv

RESETS = 100_000


def resident_mib() -> float:
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * resource.getpagesize() / 2**20


def test_memory_does_not_grow_over_resets():
    env = HelperEnv(None, observation=("rgb", "proprioception"), image_size=32, partner_image_size=32)
    rng = np.random.default_rng(0)
    before = 0.0
    for k in range(RESETS):
        env.reset(seed=k)
        env.step(rng.integers(0, [11, 32, 32]))
        if k == RESETS // 10:
            # The cache now contains all episodes, and buffers have their final size.
            before = resident_mib()
        if k % 1000 == 0:
            print(k, round(resident_mib()), "MiB", file=sys.stderr)
    assert resident_mib() < 1.05 * before


def test_a_batch_runs_a_thousand_worlds():
    names = [name for task in chaic.tasks()[:8] for name in chaic.episode_ids("train", task)]
    episodes = {name: chaic.Episode(name) for name in names}
    drawn = [episodes[names[k % len(names)]] for k in range(1000)]
    batch = chaic.Batch(drawn, list(range(1000)), images=["rgb"], image_size=32)
    rgb = np.zeros((1000, 32, 32, 3), np.uint8)
    for _ in range(3):
        assert (batch.advance() == 0).all()
        assert len(batch.observe(rgb=rgb)) == 1000
        batch.submit(np.tile([1, 0, 0], (1000, 1)))
    assert (rgb.reshape(1000, -1).max(axis=1) > 0).all()
