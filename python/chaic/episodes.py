"""Selection of episodes."""

from __future__ import annotations

import operator
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from chaic import _deprecated
from chaic._chaic import Episode, episode_ids, tasks

#: Maximum number of cached episodes; enough for all episodes of a bundled split.
MAX_CACHED = 256

#: Training split of tasks without bundled training episodes.
FALLBACK_SPLIT = "gen:0..1000"

#: Upper bound (exclusive) of the drawn seeds of worlds.
N_SEEDS = 2**31

#: Largest seed of a world.
MAX_SEED = 2**32 - 1


def task_names(task: str | Sequence[str] | None) -> list[str]:
    """Returns the names of one task, of several, or (``None``) of the paper's eight.

    Raises ``ValueError`` for an unknown task.
    """
    known = tasks()
    if task is None:
        return known[:8]
    names = [task] if isinstance(task, str) else list(task)
    for name in names:
        if name not in known:
            raise ValueError(f"unknown task {name!r}; the tasks are {', '.join(known)}")
    if not names:
        raise ValueError("name at least one task")
    return names


class EpisodeSource:
    """Episodes of a split of some tasks, drawn at random or selected by id."""

    def __init__(self, task: str | Sequence[str] | None = None, split: str | None = None) -> None:
        """Selects a split. ``None`` means the bundled training episodes, and generated ones (``FALLBACK_SPLIT``) for
        tasks without any."""
        #: Ids of all episodes.
        self.ids: list[str] = []
        for name in task_names(task):
            found = episode_ids("train" if split is None else split, name)
            self.ids += episode_ids(FALLBACK_SPLIT, name) if split is None and not found else found
        if not self.ids:
            raise ValueError(f"the split {split!r} has no episodes of these tasks")
        self._cache: dict[str, Episode] = {}

    def __len__(self) -> int:
        return len(self.ids)

    def get(self, episode_id: str) -> Episode:
        """Returns the episode with this id, which may be outside the split."""
        episode = self._cache.get(episode_id)
        if episode is None:
            episode = Episode(episode_id)
            while len(self._cache) >= MAX_CACHED:
                del self._cache[next(iter(self._cache))]
            self._cache[episode_id] = episode
        return episode

    def named(self, name: str) -> Episode:
        """Returns ``get(name)``; deprecated."""
        _deprecated.warn("EpisodeSource.named", "EpisodeSource.get")
        return self.get(name)

    def draw(self, rng: np.random.Generator) -> tuple[Episode, int]:
        """Draws an episode and a seed for its world."""
        episode_id = self.ids[int(rng.integers(len(self.ids)))]
        return self.get(episode_id), int(rng.integers(N_SEEDS))

    def choose(
        self, rng: np.random.Generator, options: Mapping[str, Any] | None
    ) -> tuple[Episode, int]:
        """Returns the episode and seed in the options of a reset; draws those that the options do not contain. The option
        ``episode`` is an id or an ``Episode``.

        Other options have no effect, as PettingZoo's test of environments requires.
        """
        episode, seed = self.draw(rng)
        if options is not None and "episode" in options:
            given = options["episode"]
            episode, seed = given if isinstance(given, Episode) else self.get(given), 0
        if options is not None and "seed" in options:
            given = options["seed"]
            try:
                seed = operator.index(given)
            except TypeError:
                raise ValueError(f"the option seed is {given!r}, expected an integer") from None
            if not 0 <= seed <= MAX_SEED:
                raise ValueError(f"the option seed is {seed}, expected 0 to {MAX_SEED}")
        return episode, seed
