"""Pictures of episodes and worlds, from any camera."""

from __future__ import annotations

import base64
import importlib
import sys
import tempfile
import webbrowser
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chaic._chaic import Episode, World


def camera(
    eye: Sequence[float],
    look_at: Sequence[float],
    *,
    vertical_fov_deg: float = 60.0,
    width: int = 512,
    height: int = 512,
) -> dict[str, Any]:
    """Returns a pinhole camera for ``World.render``. ``eye`` and ``look_at`` are points in the world, meters, y up.

    Raises ``ValueError`` if the viewing direction is undefined or vertical.
    """
    at, target = np.asarray(eye, np.float64), np.asarray(look_at, np.float64)
    is_point = at.shape == target.shape == (3,)
    forward = target - at if is_point else np.zeros(3)
    right = np.cross(forward, [0.0, 1.0, 0.0])
    if not np.linalg.norm(right) > 1e-6:
        raise ValueError(
            f"a camera at {eye} cannot look at {look_at}: give two points that differ in x or z"
        )
    forward, right = forward / np.linalg.norm(forward), right / np.linalg.norm(right)
    return {
        "eye_in_world": at.tolist(),
        "world_from_camera": _quaternion(np.column_stack([right, np.cross(right, forward), -forward])),
        "vertical_fov_rad": float(np.radians(vertical_fov_deg)),
        "width": width,
        "height": height,
    }


def _quaternion(r: NDArray[np.float64]) -> list[float]:
    """Returns the quaternion x, y, z, w of a rotation matrix. It starts from the largest component for accuracy."""
    squares = np.array([1 + 2 * r[k, k] - np.trace(r) for k in range(3)] + [1 + np.trace(r)])
    k = int(np.argmax(squares))
    q = np.empty(4)
    q[k] = np.sqrt(squares[k])
    for i in range(3):
        j, m = (i + 1) % 3, (i + 2) % 3
        difference, total = r[m, j] - r[j, m], r[m, j] + r[j, m]
        if k == 3:
            q[i] = difference / q[k]
        elif k == i:
            q[3] = difference / q[k]
        elif k == j:
            q[m] = total / q[k]
        else:
            q[j] = total / q[k]
    return [0.5 * float(component) for component in q]


def render(
    of: Episode | World,
    *,
    agent: int | None = None,
    camera: Mapping[str, Any] | None = None,
    image_size: int | None = None,
    images: str | Sequence[str] = ("rgb",),
) -> dict[str, NDArray[Any]]:
    """Renders the view of an agent (0 the partner, 1 the helper) or of a ``camera``, for a world or the start of an episode.

    ``image_size`` is the width and height of an agent's view, 512 by default; a camera has its own.
    """
    world = of if isinstance(of, World) else World(of)
    return world.render(agent=agent, camera=camera, image_size=image_size, images=images)


def show(of: Episode | World) -> None:
    """Shows the top view in the notebook or the browser."""
    png = of._repr_png_()
    if "ipykernel" in sys.modules:
        notebook: Any = importlib.import_module("IPython.display")
        notebook.display(notebook.Image(png))
        return
    page = Path(tempfile.mkdtemp(prefix="chaic-")) / "place.html"
    page.write_text(f'<img src="data:image/png;base64,{base64.b64encode(png).decode()}">')
    webbrowser.open(page.as_uri())
