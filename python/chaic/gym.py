"""The helper as a Gymnasium environment: the partner, and a child if there is one, are chaic's own minds.

A step is one decision. It takes as many frames as it takes (``info["frames"]``, 30 to a second), and the partner goes on
meanwhile: a semi-Markov decision process, for which a discount per frame is ``gamma ** info["frames"]``. ``info["action_mask"]``
is a mask for ``action_space.sample``: what the hands, or the plans that are offered, allow.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from chaic import spaces
from chaic._chaic import ACTIONS, REWARD, Planner, World
from chaic.episodes import EpisodeSource

#: The helper's number among the agents of a world.
HELPER = 1
#: Who chooses a plan that isn't offered stands still for so long, and pays for an invalid action.
INVALID_PLAN_FRAMES = 30
#: Side of the picture of ``render``, pixels.
PICTURE_SIZE = 512

Obs = dict[str, NDArray[Any]]
Info = dict[str, Any]


def reward_of(terms: Mapping[str, Any] | None, weights: Mapping[str, float]) -> float:
    """The reward of what came of an action, as ``World.reward`` has it."""
    if terms is None:
        return 0.0
    return float(
        weights["delivered"] * terms["delivered"]
        + weights["approached_per_m"] * terms["approached_m"]
        - (weights["invalid"] if terms["is_invalid"] else 0.0)
    )


def checked_weights(given: Mapping[str, float] | None) -> dict[str, float]:
    """The usual weights of a reward, with some given otherwise; ``ValueError`` for terms that there aren't."""
    weights = dict(REWARD)
    for name, weight in (given or {}).items():
        if name not in weights:
            raise ValueError(f"no term of the reward is {name!r}; there are {', '.join(weights)}")
        weights[name] = float(weight)
    return weights


class HelperEnv(gymnasium.Env[Any, Any]):
    """One helper beside the partner of a task.

    ``task`` is a task, several, or ``None`` for the paper's eight. ``observation`` names the parts of an observation:
    ``rgb`` (uint8), ``depth`` (float32 metres), ``own`` (``chaic.OWN``), ``map`` (``chaic.MAP``, what the helper
    remembers of what it saw), and ``ids`` (needs the grant). ``action`` is ``"primitive"``, a kind of action and a pixel,
    or ``"plan"``, one of the plans that are offered (``observation["plans"]``, ``info["action_mask"]``), carried out by
    chaic's planner. ``perception`` is by what planner and map tell what is in an image: ``"gt"``, which takes
    the grant ``ids``, or ``"learned"``. ``minds_image_size`` is the side of the partner's own images: with smaller ones than
    scored runs have (``None``) it sees less, and worlds are faster. What is granted stands in ``grants``.
    """

    metadata = {"render_modes": ["rgb_array", "human", "ansi"], "render_fps": 3}

    def __init__(
        self,
        task: str | Sequence[str] | None = None,
        *,
        split: str | None = None,
        observation: Sequence[str] = spaces.USUAL,
        action: str = "primitive",
        image_size: int = 128,
        grants: Sequence[str] = (),
        perception: str = "gt",
        rules: str = "paper",
        set: Sequence[str] = (),
        appearance: str = "canonical",
        minds_image_size: int | None = None,
        reward: Mapping[str, float] | None = None,
        render_mode: str | None = None,
    ) -> None:
        if action not in ("primitive", "plan"):
            raise ValueError(f'action is "primitive" or "plan", not {action!r}')
        if render_mode is not None and render_mode not in self.metadata["render_modes"]:
            raise ValueError(f"no render mode {render_mode!r}")
        self.parts = spaces.checked_parts(observation)
        self.by_plans = action == "plan"
        self.render_mode = render_mode
        self.weights = checked_weights(reward)
        self.source = EpisodeSource(task, split)
        images = spaces.images_of(self.parts)
        self._planner: Planner | None = None
        if self.by_plans or "map" in self.parts:
            self._planner = Planner(perception, image_size)
            images = sorted({*images, *self._planner.images})
            grants = sorted({*grants, *self._planner.grants})
        #: What the helper is granted (docs/grants.md).
        self.grants = tuple(grants)
        self._options: dict[str, Any] = {
            "images": images,
            "image_size": image_size,
            "grants": list(self.grants),
            "rules": rules,
            "set": list(set),
            "appearance": appearance,
            "minds_image_size": minds_image_size,
        }
        self.observation_space = spaces.observation_space(self.parts, image_size, self.by_plans)
        self.action_space = (
            spaces.plan_space() if self.by_plans else spaces.primitive_space(image_size)
        )
        #: The world, from the first reset on.
        self.world: World | None = None
        self._is_asked = False
        self._name = ""
        #: What was perceived at the last decision, which is the observation of the end, too.
        self._last: Obs = {}
        #: The next action of the plan that is followed.
        self._next: Any = None
        #: How many kinds of actions, columns and rows there are, and which kinds can be now.
        self._bounds = (len(ACTIONS), image_size, image_size)
        self._kinds: NDArray[np.bool_] = np.zeros(len(ACTIONS), bool)
        self._pixels = np.ones(image_size, np.int8)
        self._has_images = bool(spaces.images_of(self.parts))
        self._events: list[dict[str, Any]] = []
        self._window: Any = None
        # Mistakes in the options are told now, not at the first reset.
        World(self.source.named(self.source.ids[0]), 0, **self._options)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Obs, Info]:
        """Begins an episode: drawn from the split, or ``options["episode"]`` with ``options["seed"]``."""
        super().reset(seed=seed)
        episode, world_seed = self.source.choose(self.np_random, options)
        if self.world is None:
            self.world = World(episode, world_seed, **self._options)
        else:
            self.world.reset(episode, world_seed)
        self._name = episode.id
        if self._planner is not None:
            self._planner.reset(self.world.briefing(HELPER))
        self._is_asked = self.world.advance() == "waits"
        self._attend()
        if self.by_plans:
            self._follow(0.0)
        return self._observe(), self._info(0)

    def step(self, action: Any) -> tuple[Obs, float, bool, bool, Info]:
        """Carries out one decision, and plays on until the next one."""
        world = self.world
        if world is None:
            raise gymnasium.error.ResetNeeded("reset the environment before its first step")
        if not self._is_asked:
            raise gymnasium.error.ResetNeeded("the episode is over; reset the environment")
        before = world.frame
        if self.by_plans:
            reward = self._step_plan(action)
        else:
            reward = self._act(spaces.checked_row(action, self._bounds))
        if self.render_mode == "human":
            self.render()
        done, total = world.progress()
        complete = done >= total
        over = not self._is_asked
        info = self._info(world.frame - before)
        return self._observe(), reward, over and complete, over and not complete, info

    def _step_plan(self, action: Any) -> float:
        assert self._planner is not None
        if not isinstance(action, int | np.integer):
            raise ValueError(f"{action!r} is not in {self.action_space}")
        index = int(action)
        if not self.action_space.contains(index):
            raise ValueError(f"{action!r} is not in {self.action_space}")
        if index < len(self._planner.plans()):
            self._next = self._planner.choose(index)
            return self._follow(0.0)
        self._next = {"wait": {"frames": INVALID_PLAN_FRAMES}}
        return self._follow(-self.weights["invalid"])

    def _follow(self, reward: float) -> float:
        """Acts by the plan that is followed until a choice is due or the episode ends; the reward."""
        while self._is_asked and self._next is not None:
            reward += self._act(self._next)
        return reward

    def _act(self, action: Any) -> float:
        """Acts once and plays on until the helper is asked again; the reward."""
        assert self.world is not None
        self._is_asked, delivered, approached_m, is_invalid = self.world.step(action)
        self._attend()
        weights = self.weights
        return (
            weights["delivered"] * delivered
            + weights["approached_per_m"] * approached_m
            - (weights["invalid"] if is_invalid else 0.0)
        )

    def _attend(self) -> None:
        """Lets the planner see what the helper sees."""
        if self._planner is None or not self._is_asked:
            return
        assert self.world is not None
        seen = self.world.observe(HELPER)
        if self.by_plans:
            self._next = self._planner.attend(seen)
        else:
            self._planner.look(seen)

    def _observe(self) -> Obs:
        world = self.world
        assert world is not None
        if not self._is_asked:
            return {part: array.copy() for part, array in self._last.items()}
        own, self._kinds = world.own(HELPER)
        seen = world.observe(HELPER) if self._has_images else None
        out: Obs = {}
        for part in self.parts:
            if part == "own":
                out["own"] = own
            elif part == "map":
                assert self._planner is not None
                out["map"] = self._planner.semantic_map(spaces.MAP_SIDE, spaces.MAP_CELL_M)
            else:
                out[part] = getattr(seen, part)
        if self.by_plans:
            assert self._planner is not None
            numbers = self._planner.plan_numbers()[: spaces.MOST_PLANS]
            plans = np.zeros((spaces.MOST_PLANS, numbers.shape[1]), np.float32)
            plans[: len(numbers)] = numbers
            out["plans"] = plans
        self._last = out
        return out

    def action_masks(self) -> NDArray[np.bool_]:
        """What can be chosen now, as maskable PPO of sb3-contrib asks for it: plans, or kinds of actions and (all) columns
        and rows, one after the other."""
        mask = self._mask()
        return np.concatenate(mask if isinstance(mask, tuple) else (mask,)).astype(bool)

    def _mask(self) -> Any:
        if self.by_plans:
            assert self._planner is not None
            plans = len(self._planner.plans()) if self._is_asked else 0
            return (np.arange(spaces.MOST_PLANS) < plans).astype(np.int8)
        kinds = self._kinds if self._is_asked else np.zeros(len(ACTIONS), bool)
        return kinds.astype(np.int8), self._pixels.copy(), self._pixels.copy()

    def _info(self, frames: int) -> Info:
        world = self.world
        assert world is not None
        done, total = world.progress()
        self._events = world.take_events()
        return {
            "frames": frames,
            "frame": world.frame,
            "events": self._events,
            "action_mask": self._mask(),
            "tr": done / total if total else 0.0,
            "episode_id": self._name,
        }

    def render(self) -> Any:
        """What the helper sees now: a picture, a window, or words."""
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
            f"{score['done']:g} of {score['total']:g} delivered"
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
            pygame.display.set_caption("chaic: what the helper sees")
        pygame.event.pump()
        surface = pygame.surfarray.make_surface(picture.swapaxes(0, 1))
        self._window.blit(surface, (0, 0))
        pygame.display.flip()

    def close(self) -> None:
        """Closes the window, if there is one."""
        if self._window is not None:
            import pygame

            pygame.quit()
            self._window = None
