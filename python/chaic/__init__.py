"""chaic: simulator and benchmark for constrained human-AI cooperation.

``import chaic`` registers its environments with Gymnasium: ``gymnasium.make("chaic/HighTarget-v0")``. ``World`` is one
running episode, ``Batch`` holds many worlds that run on all cores, and ``evaluate`` plays a benchmark with Python helpers.
``chaic.gym``, ``chaic.vector`` and ``chaic.zoo`` contain the Gymnasium and PettingZoo environments, and ``chaic.ray`` plays
benchmarks on a Ray cluster. Import these modules when you need them.
"""

from __future__ import annotations

from typing import Any

from chaic import _chaic, _deprecated
from chaic._chaic import (
    ACTIONS,
    MAP,
    PLAN_FEATURES,
    PROPRIOCEPTION,
    REWARD,
    Batch,
    Briefing,
    Detector,
    Episode,
    Observation,
    Planner,
    PlanningAgent,
    Snapshot,
    World,
    __version__,
    classes,
    encode_png,
    episode_ids,
    tasks,
)
from chaic.episodes import EpisodeSource
from chaic.pictures import camera, render, show
from chaic.registry import register as _register
from chaic.runs import Helper, Run, evaluate, merge, play

__all__ = [
    "ACTIONS",
    "MAP",
    "PLAN_FEATURES",
    "PROPRIOCEPTION",
    "REWARD",
    "Batch",
    "Briefing",
    "Detector",
    "Episode",
    "EpisodeSource",
    "Helper",
    "Observation",
    "Planner",
    "PlanningAgent",
    "Run",
    "Snapshot",
    "World",
    "__version__",
    "camera",
    "classes",
    "encode_png",
    "episode_ids",
    "evaluate",
    "merge",
    "play",
    "render",
    "show",
    "tasks",
]

_RENAMED = {"OWN": "PROPRIOCEPTION", "PLAN": "PLAN_FEATURES", "Mind": "PlanningAgent"}


def __getattr__(name: str) -> Any:
    """Returns the value of an old name, with a ``DeprecationWarning``."""
    new = _RENAMED.get(name)
    if new is None:
        raise AttributeError(f"module 'chaic' has no attribute {name!r}")
    _deprecated.warn(f"chaic.{name}", f"chaic.{new}")
    return getattr(_chaic, new)


_register()
