"""Which episode is played next."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from chaic._chaic import Episode, episode_ids, tasks

#: Episodes that are kept once they were read: of a bundled split all, of a generated one the last ones.
MOST_KEPT = 256

#: What is trained on where no training episodes come with chaic.
OTHERS = "gen:0..1000"

#: Worlds are played with seeds below this.
SEEDS = 2**31


def tasks_named(task: str | Sequence[str] | None) -> list[str]:
    """The tasks of a name, of several, or (``None``) the paper's eight.

    Raises ``ValueError`` if there is no such task.
    """
    known = tasks()
    if task is None:
        return known[:8]
    named = [task] if isinstance(task, str) else list(task)
    for name in named:
        if name not in known:
            raise ValueError(f"no task {name!r}; there are {', '.join(known)}")
    if not named:
        raise ValueError("name at least one task")
    return named


class EpisodeSource:
    """Episodes of some tasks of a split, drawn at random or by name."""

    def __init__(self, task: str | Sequence[str] | None = None, split: str | None = None) -> None:
        """Episodes of a split; of ``None`` the training episodes that come with chaic, or generated ones (``OTHERS``)
        of tasks that have none."""
        #: The names of all episodes.
        self.ids: list[str] = []
        for name in tasks_named(task):
            found = episode_ids("train" if split is None else split, name)
            self.ids += episode_ids(OTHERS, name) if split is None and not found else found
        if not self.ids:
            raise ValueError(f"the split {split!r} has no episodes of these tasks")
        self._kept: dict[str, Episode] = {}

    def __len__(self) -> int:
        return len(self.ids)

    def named(self, name: str) -> Episode:
        """The episode of a name, whether or not it is in the split."""
        episode = self._kept.get(name)
        if episode is None:
            episode = Episode(name)
            while len(self._kept) >= MOST_KEPT:
                del self._kept[next(iter(self._kept))]
            self._kept[name] = episode
        return episode

    def draw(self, rng: np.random.Generator) -> tuple[Episode, int]:
        """Any episode, and a seed for its world."""
        name = self.ids[int(rng.integers(len(self.ids)))]
        return self.named(name), int(rng.integers(SEEDS))

    def choose(
        self, rng: np.random.Generator, options: Mapping[str, Any] | None
    ) -> tuple[Episode, int]:
        """The episode and seed that the options of a reset name, where they do; as ``draw`` otherwise."""
        episode, seed = self.draw(rng)
        if options is not None and "episode" in options:
            episode, seed = self.named(options["episode"]), 0
        if options is not None and "seed" in options:
            seed = int(options["seed"])
        return episode, seed
