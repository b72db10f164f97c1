"""chaic: constrained human-AI cooperation, simulated, from Python.

``import chaic`` tells Gymnasium of its environments: ``gymnasium.make("chaic/HighTarget-v0")``. ``World`` is one episode under way, ``Batch`` many of them on all cores, ``evaluate`` a whole benchmark with helpers of
your own; ``chaic.gym``, ``chaic.vector`` and ``chaic.zoo`` are the interfaces of Gymnasium and PettingZoo, and ``chaic.ray`` plays benchmarks on a cluster;
they are imported when they are needed.
"""

from __future__ import annotations

from chaic._chaic import (
    ACTIONS,
    MAP,
    OWN,
    PLAN,
    REWARD,
    Batch,
    Briefing,
    Detector,
    Episode,
    Mind,
    Observation,
    Planner,
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
from chaic.runs import Helper, Run, evaluate, merge

__all__ = [
    "ACTIONS",
    "MAP",
    "OWN",
    "PLAN",
    "REWARD",
    "Batch",
    "Briefing",
    "Detector",
    "Episode",
    "EpisodeSource",
    "Helper",
    "Mind",
    "Observation",
    "Planner",
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
    "render",
    "show",
    "tasks",
]

_register()
