"""The spaces of observations and actions that the interfaces share."""

from __future__ import annotations

import operator
from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from chaic._chaic import ACTIONS, MAP, OWN, PLAN, classes

#: What may be in an observation, by name.
PARTS = ("rgb", "depth", "ids", "own", "map")
#: What usually is.
USUAL = ("rgb", "depth", "own")

#: Depth of a pixel that shows nothing, metres.
FAR_M = 100.0
#: No place is farther from the middle of the world, or from a body, metres.
FARTHEST_M = 1000.0
#: Most plans that are offered at a time; those beyond are left out, farthest first.
MOST_PLANS = 32
#: The semantic map: cells along each side, and the side of a cell in metres.
MAP_SIDE = 64
MAP_CELL_M = 0.25


def checked_parts(parts: Sequence[str]) -> tuple[str, ...]:
    """The parts of an observation; ``ValueError`` for what there isn't."""
    if isinstance(parts, str):
        parts = (parts,)
    for part in parts:
        if part not in PARTS:
            raise ValueError(f"no part of an observation is {part!r}; there are {', '.join(PARTS)}")
    if not parts:
        raise ValueError("an observation has at least one part")
    return tuple(part for part in PARTS if part in parts)


def images_of(parts: Sequence[str]) -> list[str]:
    """Those of the parts that are images."""
    return [part for part in parts if part in ("rgb", "depth", "ids")]


def own_space() -> spaces.Box:
    """What an agent knows of itself, as numbers (``chaic.OWN``)."""
    within = {"x_m": FARTHEST_M, "z_m": FARTHEST_M, "left_contents": 16.0, "right_contents": 16.0}
    signed = ("x_m", "z_m", "sin_yaw", "cos_yaw")
    high = np.array([within.get(name, 1.0) for name in OWN], np.float32)
    low = np.where([name in signed for name in OWN], -high, 0.0).astype(np.float32)
    return spaces.Box(low, high, dtype=np.float32)


def plan_numbers_space() -> spaces.Box:
    """The plans that are offered, as numbers (``chaic.PLAN``); zeros where there is none."""
    within = {"class": float(n_classes()), "right_m": FARTHEST_M, "ahead_m": FARTHEST_M}
    low_of = {"class": -1.0, "right_m": -FARTHEST_M, "ahead_m": -FARTHEST_M}
    high = np.array([within.get(name, 1.0) for name in PLAN], np.float32)
    low = np.array([low_of.get(name, 0.0) for name in PLAN], np.float32)
    shape = (MOST_PLANS, 1)
    return spaces.Box(np.tile(low, shape), np.tile(high, shape), dtype=np.float32)


def observation_space(
    parts: Sequence[str], image_size: int, plans: bool = False
) -> spaces.Dict:
    """The space of observations with these parts."""
    size = image_size
    every: dict[str, spaces.Space[Any]] = {
        "rgb": spaces.Box(0, 255, (size, size, 3), np.uint8),
        "depth": spaces.Box(0.0, FAR_M, (size, size), np.float32),
        "ids": spaces.Box(0, 2**16 - 1, (size, size), np.uint16),
        "own": own_space(),
        "map": spaces.Box(0, 1, (len(MAP), MAP_SIDE, MAP_SIDE), np.uint8),
    }
    chosen = {part: every[part] for part in parts}
    if plans:
        chosen["plans"] = plan_numbers_space()
    return spaces.Dict(chosen)


def primitive_space(image_size: int) -> spaces.MultiDiscrete:
    """A kind of action (``chaic.ACTIONS``), and the column and row of the pixel that it is about."""
    return spaces.MultiDiscrete(np.array([len(ACTIONS), image_size, image_size], np.int64))


def checked_row(action: Any, bounds: Sequence[int]) -> list[int]:
    """An action of that space as plain numbers; ``ValueError`` if it is none."""
    try:
        row = [operator.index(x) for x in action]
    except TypeError:
        row = []
    if len(row) != len(bounds) or not all(
        0 <= x < n for x, n in zip(row, bounds, strict=True)
    ):
        raise ValueError(f"{action!r} is no action: expected integers below {list(bounds)}")
    return row


def primitive_mask(
    kinds: NDArray[Any], image_size: int
) -> tuple[NDArray[np.int8], NDArray[np.int8], NDArray[np.int8]]:
    """The mask for ``sample`` of that space: the kinds of actions that can be, and any pixel."""
    pixels = np.ones(image_size, np.int8)
    return kinds.astype(np.int8), pixels, pixels


def plan_space() -> spaces.Discrete:
    """One of the plans that are offered."""
    return spaces.Discrete(MOST_PLANS)


def n_classes() -> int:
    """How many classes the catalogue has."""
    return len(classes())
