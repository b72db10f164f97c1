"""Spaces of observations and actions, for Gymnasium and PettingZoo."""

from __future__ import annotations

import operator
from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from chaic._chaic import ACTIONS, MAP, PLAN_FEATURES, PROPRIOCEPTION, classes

#: Parts of an observation.
PARTS = ("rgb", "depth", "ids", "proprioception", "map")
#: Default parts.
DEFAULT_PARTS = ("rgb", "depth", "proprioception")

#: Maximum depth, meters; also the depth of a pixel without a surface.
MAX_DEPTH_M = 100.0
#: Bound of positions relative to the origin of the world or to a body, meters.
MAX_COORDINATE_M = 1000.0
#: Maximum number of offered plans; further plans are dropped. The standard split has at most 52 plans: a target for each of
#: 33 objects, six containers, seven obstacles, and six plans without an object.
MAX_PLANS = 64
#: Semantic map: cells along each side, and the size of a cell, meters.
MAP_SIDE = 64
MAP_CELL_M = 0.25


def parse_parts(parts: Sequence[str]) -> tuple[str, ...]:
    """Returns the parts of an observation in canonical order. Raises ``ValueError`` for an unknown part."""
    if isinstance(parts, str):
        parts = (parts,)
    for part in parts:
        if part not in PARTS:
            raise ValueError(f"unknown part of an observation {part!r}; the parts are {', '.join(PARTS)}")
    if not parts:
        raise ValueError("an observation has at least one part")
    return tuple(part for part in PARTS if part in parts)


def image_parts(parts: Sequence[str]) -> list[str]:
    """Returns the parts that are images."""
    return [part for part in parts if part in ("rgb", "depth", "ids")]


def proprioception_space() -> spaces.Box:
    """Returns the space of proprioception (``chaic.PROPRIOCEPTION``)."""
    high_of = {"x_m": MAX_COORDINATE_M, "z_m": MAX_COORDINATE_M, "left_contents": 16.0, "right_contents": 16.0}
    signed = ("x_m", "z_m", "sin_yaw", "cos_yaw")
    high = np.array([high_of.get(name, 1.0) for name in PROPRIOCEPTION], np.float32)
    low = np.where([name in signed for name in PROPRIOCEPTION], -high, 0.0).astype(np.float32)
    return spaces.Box(low, high, dtype=np.float32)


def plan_vectors_space() -> spaces.Box:
    """Returns the space of the vectors of offered plans (``chaic.PLAN_FEATURES``); unused rows are zero."""
    high_of = {"class": float(n_classes()), "right_m": MAX_COORDINATE_M, "ahead_m": MAX_COORDINATE_M}
    low_of = {"class": -1.0, "right_m": -MAX_COORDINATE_M, "ahead_m": -MAX_COORDINATE_M}
    high = np.array([high_of.get(name, 1.0) for name in PLAN_FEATURES], np.float32)
    low = np.array([low_of.get(name, 0.0) for name in PLAN_FEATURES], np.float32)
    shape = (MAX_PLANS, 1)
    return spaces.Box(np.tile(low, shape), np.tile(high, shape), dtype=np.float32)


def observation_space(
    parts: Sequence[str], image_size: int, plans: bool = False
) -> spaces.Dict:
    """Returns the space of observations with these parts."""
    size = image_size
    by_part: dict[str, spaces.Space[Any]] = {
        "rgb": spaces.Box(0, 255, (size, size, 3), np.uint8),
        "depth": spaces.Box(0.0, MAX_DEPTH_M, (size, size), np.float32),
        "ids": spaces.Box(0, 2**16 - 1, (size, size), np.uint16),
        "proprioception": proprioception_space(),
        "map": spaces.Box(0, 1, (len(MAP), MAP_SIDE, MAP_SIDE), np.uint8),
    }
    chosen = {part: by_part[part] for part in parts}
    if plans:
        chosen["plans"] = plan_vectors_space()
    return spaces.Dict(chosen)


def primitive_space(image_size: int) -> spaces.MultiDiscrete:
    """Returns the space of a kind of action (``chaic.ACTIONS``) with column and row of the target pixel."""
    return spaces.MultiDiscrete(np.array([len(ACTIONS), image_size, image_size], np.int64))


def parse_row(action: Any, bounds: Sequence[int]) -> list[int]:
    """Converts an action of the primitive space to integers. Raises ``ValueError`` if it is not in the space."""
    try:
        row = [operator.index(x) for x in action]
    except TypeError:
        row = []
    if len(row) != len(bounds) or not all(
        0 <= x < n for x, n in zip(row, bounds, strict=True)
    ):
        raise ValueError(f"invalid action {action!r}: expected integers from 0 to below {list(bounds)}")
    return row


def primitive_mask(
    kinds: NDArray[Any], image_size: int
) -> tuple[NDArray[np.int8], NDArray[np.int8], NDArray[np.int8]]:
    """Returns the mask for ``sample`` of the primitive space: these kinds of actions, and all pixels."""
    pixels = np.ones(image_size, np.int8)
    return kinds.astype(np.int8), pixels, pixels


def plan_space() -> spaces.Discrete:
    """Returns the space of indices of offered plans."""
    return spaces.Discrete(MAX_PLANS)


def n_classes() -> int:
    """Returns the number of classes in the catalogue."""
    return len(classes())
