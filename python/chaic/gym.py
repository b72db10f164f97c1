"""Gymnasium environment of the helper; chaic simulates the partner and the child.

A step is one decision. It takes ``info["frames"]`` frames, 30 per second, while the partner continues. The environment is
thus a semi-Markov decision process; use ``gamma ** info["frames"]`` to discount per frame. ``info["action_mask"]`` is a mask
for ``action_space.sample``: the actions that the hands allow, or the offered plans.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from chaic import _deprecated, spaces
from chaic._chaic import ACTIONS, REWARD, Planner, World, weigh_reward
from chaic._recreated import Recreated
from chaic.episodes import EpisodeSource

#: Agent id of the helper in a world.
HELPER = 1
#: Duration of the wait after the choice of a plan that is not offered; it also costs the penalty of an invalid action.
INVALID_PLAN_FRAMES = 30
#: Width and height of the picture of ``render``, pixels.
PICTURE_SIZE = 512

Obs = dict[str, NDArray[Any]]
Info = dict[str, Any]


def reward_weights(changes: Mapping[str, float] | None) -> dict[str, float]:
    """Returns the default reward weights with these changes.

    Raises ``ValueError`` for an unknown term or a weight that is not finite.
    """
    changed = dict(changes or {})
    _deprecated.rename_keys(changed, {"approached_per_m": "progress_per_m"})
    weights = dict(REWARD)
    for name, weight in changed.items():
        if name not in weights:
            raise ValueError(f"unknown reward term {name!r}; the terms are {', '.join(weights)}")
        weights[name] = float(weight)
        if not math.isfinite(weights[name]):
            raise ValueError(f"the weight of the reward term {name!r} is {weight}, expected a finite number")
    return weights


class HelperEnv(Recreated, gymnasium.Env[Any, Any]):
    """Environment of one helper and the simulated partner of a task.

    - ``task``: a task, several, or ``None`` for the paper's eight.
    - ``observation``: any of ``rgb`` (uint8), ``depth`` (float32 meters), ``proprioception``
      (``chaic.PROPRIOCEPTION``), ``map`` (egocentric map of the memory, ``chaic.MAP``), and ``ids`` (needs the grant).
    - ``action``: ``"primitive"`` is a kind of action and a pixel. ``"plan"`` is the index of an offered plan
      (``observation["plans"]``, ``info["action_mask"]``), which chaic's planner executes.
    - ``perception`` of planner and map: ``"gt"``, which adds the grant ``ids``, or ``"learned"``. Without both, only
      ``"gt"`` is valid.
    - ``grants`` and ``set``: one string or several, such as ``set="world.stride_m=0.5"``.
    - ``partner_image_size``: width and height of the partner's images, pixels; ``None`` for those of scored runs. A smaller
      size is faster and reduces what the partner sees. ``minds_image_size`` is its deprecated name.

    The attribute ``grants`` lists all grants. ``pickle`` and ``copy`` create a new environment from the same arguments, which
    needs a reset.
    """

    metadata = {"render_modes": ["rgb_array", "human", "ansi"], "render_fps": 3}

    def __init__(
        self,
        task: str | Sequence[str] | None = None,
        *,
        split: str | None = None,
        observation: Sequence[str] = spaces.DEFAULT_PARTS,
        action: str = "primitive",
        image_size: int = 128,
        grants: Sequence[str] = (),
        perception: str = "gt",
        rules: str = "paper",
        set: Sequence[str] = (),
        appearance: str = "canonical",
        partner_image_size: int | None = None,
        reward: Mapping[str, float] | None = None,
        render_mode: str | None = None,
        minds_image_size: int | None = None,
    ) -> None:
        partner_image_size = _deprecated.partner_image_size(partner_image_size, minds_image_size)
        if action not in ("primitive", "plan"):
            raise ValueError(f'action is {action!r}, expected "primitive" or "plan"')
        if render_mode is not None and render_mode not in self.metadata["render_modes"]:
            modes = ", ".join(self.metadata["render_modes"])
            raise ValueError(f"unknown render mode {render_mode!r}; the modes are {modes}")
        self.parts = spaces.parse_parts(observation)
        self._uses_plans = action == "plan"
        self.render_mode = render_mode
        self.weights = reward_weights(reward)
        self.source = EpisodeSource(task, split)
        images = spaces.image_parts(self.parts)
        grants = (grants,) if isinstance(grants, str) else tuple(grants)
        settings = [set] if isinstance(set, str) else list(set)
        self._planner: Planner | None = None
        if self._uses_plans or "map" in self.parts:
            self._planner = Planner(perception, image_size, rules=rules, set=settings)
            images = sorted({*images, *self._planner.images})
            grants = sorted({*grants, *self._planner.grants})
        elif perception != "gt":
            raise ValueError('perception applies to action="plan" and to the part "map" only; add one of them')
        #: Grants of the helper (docs/grants.md).
        self.grants = tuple(grants)
        self._options: dict[str, Any] = {
            "images": images,
            "image_size": image_size,
            "grants": list(self.grants),
            "rules": rules,
            "set": settings,
            "appearance": appearance,
            "partner_image_size": partner_image_size,
        }
        # Invalid options raise an error here, not in the first reset.
        World(self.source.get(self.source.ids[0]), 0, **self._options)
        self.observation_space = spaces.observation_space(self.parts, image_size, self._uses_plans)
        self.action_space = (
            spaces.plan_space() if self._uses_plans else spaces.primitive_space(image_size)
        )
        #: World; ``None`` before the first reset.
        self.world: World | None = None
        self._needs_action = False
        self._episode_id = ""
        #: Observation at the last decision; also the final observation of an episode.
        self._last: Obs = {}
        #: Next action of the current plan.
        self._next_action: Any = None
        #: Numbers of kinds of actions, columns and rows, and the mask of the possible kinds.
        self._bounds = (len(ACTIONS), image_size, image_size)
        self._kind_mask: NDArray[np.bool_] = np.zeros(len(ACTIONS), bool)
        self._pixel_mask = np.ones(image_size, np.int8)
        self._has_images = bool(spaces.image_parts(self.parts))
        self._events: list[dict[str, Any]] = []
        self._window: Any = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Obs, Info]:
        """Starts an episode: one drawn from the split, or ``options["episode"]``, an id or an ``Episode``, with
        ``options["seed"]``. Raises ``ValueError`` for other options."""
        if unknown := {*(options or ())} - {"episode", "seed"}:
            raise ValueError(f"an environment has no reset option {sorted(unknown)}; it has episode and seed")
        super().reset(seed=seed)
        episode, world_seed = self.source.choose(self.np_random, options)
        if self.world is None:
            self.world = World(episode, world_seed, **self._options)
        else:
            self.world.reset(episode, world_seed)
        self._episode_id = episode.id
        if self._planner is not None:
            self._planner.reset(self.world.briefing(HELPER))
        self._needs_action = self.world.advance() == "needs_action"
        self._update_planner()
        if self._uses_plans:
            self._execute_plan(0.0)
        if self.render_mode == "human":
            self.render()
        return self._observe(), self._info(0)

    def step(self, action: Any) -> tuple[Obs, float, bool, bool, Info]:
        """Executes one decision and advances to the next one."""
        world = self.world
        if world is None:
            raise gymnasium.error.ResetNeeded("reset the environment before its first step")
        if not self._needs_action:
            raise gymnasium.error.ResetNeeded("the episode is over; reset the environment")
        before = world.frame
        if self._uses_plans:
            reward = self._step_plan(action)
        else:
            reward = self._act(spaces.parse_row(action, self._bounds))
        if self.render_mode == "human":
            self.render()
        delivered, wanted = world.progress()
        complete = delivered >= wanted
        ended = not self._needs_action
        info = self._info(world.frame - before)
        return self._observe(), reward, ended and complete, ended and not complete, info

    def _step_plan(self, action: Any) -> float:
        assert self._planner is not None
        # Policies may return a zero-dimensional array instead of an integer.
        try:
            index = operator.index(action)
        except TypeError:
            raise ValueError(f"{action!r} is not in {self.action_space}") from None
        if not self.action_space.contains(index):
            raise ValueError(f"{action!r} is not in {self.action_space}")
        if index < len(self._planner.plans()):
            self._next_action = self._planner.choose(index)
            return self._execute_plan(0.0)
        self._next_action = {"wait": {"frames": INVALID_PLAN_FRAMES}}
        return self._execute_plan(-self.weights["invalid"])

    def _execute_plan(self, reward: float) -> float:
        """Executes the current plan until the next choice or the end of the episode; returns the reward."""
        while self._needs_action and self._next_action is not None:
            reward += self._act(self._next_action)
        return reward

    def _act(self, action: Any) -> float:
        """Executes one action and advances until the helper needs the next one; returns the reward."""
        assert self.world is not None
        self._needs_action, delivered, progress_m, is_invalid = self.world.step(action)
        self._update_planner()
        return weigh_reward(delivered, progress_m, is_invalid, self.weights)

    def _update_planner(self) -> None:
        """Passes the helper's observation to the planner."""
        if self._planner is None or not self._needs_action:
            return
        assert self.world is not None
        observation = self.world.observe(HELPER)
        if self._uses_plans:
            self._next_action = self._planner.act(observation)
        else:
            self._planner.observe(observation)

    def _observe(self) -> Obs:
        world = self.world
        assert world is not None
        if not self._needs_action:
            return {part: array.copy() for part, array in self._last.items()}
        proprioception, self._kind_mask = world.proprioception(HELPER)
        observation = world.observe(HELPER) if self._has_images else None
        out: Obs = {}
        for part in self.parts:
            if part == "proprioception":
                out["proprioception"] = proprioception
            elif part == "map":
                assert self._planner is not None
                out["map"] = self._planner.semantic_map(spaces.MAP_SIDE, spaces.MAP_CELL_M)
            else:
                out[part] = getattr(observation, part)
        if self._uses_plans:
            assert self._planner is not None
            vectors = self._planner.plan_features()[: spaces.MAX_PLANS]
            plans = np.zeros((spaces.MAX_PLANS, vectors.shape[1]), np.float32)
            plans[: len(vectors)] = vectors
            out["plans"] = plans
        # Returns a copy, because a caller may change the array.
        self._last = {part: array.copy() for part, array in out.items()}
        return out

    def action_masks(self) -> NDArray[np.bool_]:
        """Returns the mask of valid actions for MaskablePPO of sb3-contrib: plans, or the concatenation of kinds of
        actions, columns and rows."""
        mask = self._mask()
        return np.concatenate(mask if isinstance(mask, tuple) else (mask,)).astype(bool)

    def _mask(self) -> Any:
        if self._uses_plans:
            assert self._planner is not None
            n_plans = len(self._planner.plans()) if self._needs_action else 0
            return (np.arange(spaces.MAX_PLANS) < n_plans).astype(np.int8)
        kinds = self._kind_mask if self._needs_action else np.zeros(len(ACTIONS), bool)
        return kinds.astype(np.int8), self._pixel_mask.copy(), self._pixel_mask.copy()

    def _info(self, frames: int) -> Info:
        world = self.world
        assert world is not None
        delivered, wanted = world.progress()
        self._events = world.take_events()
        return {
            "frames": frames,
            "frame": world.frame,
            "events": self._events,
            "action_mask": self._mask(),
            "tr": delivered / wanted if wanted else 0.0,
            "episode_id": self._episode_id,
        }

    def render(self) -> Any:
        """Returns the helper's view as an array or the state as text, or shows the view in a window, by ``render_mode``."""
        if self.render_mode is None or self.world is None:
            return None
        if self.render_mode == "ansi":
            return self._text()
        picture = self.world.render(HELPER, image_size=PICTURE_SIZE)["rgb"]
        if self.render_mode == "rgb_array":
            return picture
        self._show(picture)
        return None

    def _text(self) -> str:
        world = self.world
        assert world is not None
        score = world.score()
        lines = [
            f"{world.episode.id}: frame {world.frame} of {world.horizon}, "
            f"{score['delivered']:g} of {score['wanted']:g} delivered"
        ]
        lines += [", ".join(f"{k} {v}" for k, v in event.items()) for event in self._events]
        return "\n".join(lines)

    def _show(self, picture: NDArray[np.uint8]) -> None:
        try:
            import pygame
        except ImportError as error:
            problem = 'render_mode "human" needs pygame: pip install pygame'
            raise gymnasium.error.DependencyNotInstalled(problem) from error
        if self._window is None:
            pygame.init()
            self._window = pygame.display.set_mode((PICTURE_SIZE, PICTURE_SIZE))
            pygame.display.set_caption("chaic: view of the helper")
        pygame.event.pump()
        surface = pygame.surfarray.make_surface(picture.swapaxes(0, 1))
        self._window.blit(surface, (0, 0))
        pygame.display.flip()

    def close(self) -> None:
        """Closes the window, if one is open."""
        if self._window is not None:
            import pygame

            pygame.quit()
            self._window = None
