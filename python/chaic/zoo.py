"""Partner and helper as a PettingZoo environment: either of them, or both, can be learners or people.

``env`` is an AEC environment, which is exactly chaic's clock: the agent whose action has ended is next. ``parallel_env`` is
for algorithms that step all agents at once; its waiting rule: whoever is still busy with an earlier action perceives
what it perceived last (``info["asked"]`` is 0), and its choice isn't looked at.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray
from pettingzoo import AECEnv, ParallelEnv

from chaic import spaces
from chaic._chaic import ACTIONS, World
from chaic.episodes import EpisodeSource
from chaic.gym import PICTURE_SIZE, Obs, checked_weights, reward_of

#: The agents, in the order of their numbers in a world.
AGENTS: tuple[str, ...] = ("partner", "helper")


class _Pair:
    """A world with both seats the caller's: what both interfaces share."""

    def __init__(
        self,
        task: str | Sequence[str] | None,
        split: str | None,
        observation: Sequence[str],
        image_size: int,
        grants: Sequence[str],
        rules: str,
        set: Sequence[str],
        appearance: str,
        reward: Mapping[str, float] | None,
    ) -> None:
        self.parts = spaces.checked_parts(observation)
        if "map" in self.parts:
            raise ValueError("an environment of two agents has no map")
        self.weights = checked_weights(reward)
        self.source = EpisodeSource(task, split)
        self.image_size = image_size
        self._options: dict[str, Any] = {
            "partner": "caller",
            "images": spaces.images_of(self.parts),
            "image_size": image_size,
            "grants": list(grants),
            "rules": rules,
            "set": list(set),
            "appearance": appearance,
        }
        self._world: World | None = None
        self._rng = np.random.default_rng()
        World(self.source.named(self.source.ids[0]), 0, **self._options)

    @property
    def world(self) -> World:
        if self._world is None:
            raise gymnasium.error.ResetNeeded("reset the environment before its first step")
        return self._world

    def begin(self, seed: int | None, options: dict[str, Any] | None) -> None:
        if seed is not None:
            self._rng = np.random.default_rng(seed)
        episode, world_seed = self.source.choose(self._rng, options)
        if self._world is None:
            self._world = World(episode, world_seed, **self._options)
        else:
            self._world.reset(episode, world_seed)

    def observe(self, agent: int) -> Obs:
        seen = self.world.observe(agent)
        return {
            part: self.world.own(agent)[0] if part == "own" else getattr(seen, part)
            for part in self.parts
        }

    def blank(self) -> Obs:
        space = self.observation_space()
        return {name: np.zeros(s.shape or (), s.dtype) for name, s in space.spaces.items()}

    def observation_space(self) -> gymnasium.spaces.Dict:
        return spaces.observation_space(self.parts, self.image_size)

    def submit(self, agent: int, action: Any) -> None:
        bounds = (len(ACTIONS), self.image_size, self.image_size)
        self.world.submit(spaces.checked_row(action, bounds), agent)

    def reward(self, agent: int) -> float:
        return reward_of(self.world.reward(agent), self.weights)

    def info(self, agent: int, asked: bool) -> dict[str, Any]:
        world = self.world
        score = world.score()
        kinds: NDArray[Any] = world.own(agent)[1] if asked else np.zeros(len(ACTIONS), bool)
        return {
            "asked": int(asked),
            "frame": world.frame,
            "action_mask": spaces.primitive_mask(kinds, self.image_size),
            "tr": score["done"] / score["total"] if score["total"] else 0.0,
            "episode_id": world.episode.id,
        }


class _Interface:
    """What both interfaces are made with, and have alike."""

    def __init__(
        self,
        task: str | Sequence[str] | None = None,
        *,
        split: str | None = None,
        observation: Sequence[str] = spaces.USUAL,
        image_size: int = 128,
        grants: Sequence[str] = (),
        rules: str = "paper",
        set: Sequence[str] = (),
        appearance: str = "canonical",
        reward: Mapping[str, float] | None = None,
        max_cycles: int | None = None,
        render_mode: str | None = None,
    ) -> None:
        super().__init__()
        self._pair = _Pair(
            task, split, observation, image_size, grants, rules, set, appearance, reward
        )
        self.max_cycles = max_cycles
        self.render_mode = render_mode
        self.possible_agents = list(AGENTS)
        self.agents: list[str] = []
        self.observation_spaces: dict[str, gymnasium.Space[Any]] = {
            a: self._pair.observation_space() for a in AGENTS
        }
        self.action_spaces: dict[str, gymnasium.Space[Any]] = {
            a: spaces.primitive_space(image_size) for a in AGENTS
        }

    def observation_space(self, agent: str) -> gymnasium.Space[Any]:
        """The space of what an agent perceives."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> gymnasium.Space[Any]:
        """The space of what an agent can do."""
        return self.action_spaces[agent]

    @property
    def world(self) -> World:
        """The world."""
        return self._pair.world

    def render(self) -> Any:
        """What the helper sees, uint8 [512, 512, 3]."""
        if self.render_mode != "rgb_array":
            return None
        return self.world.render(1, image_size=PICTURE_SIZE)["rgb"]

    def close(self) -> None:
        """Nothing is open."""


class PairEnv(_Interface, AECEnv[str, Obs, Any]):
    """Partner and helper, asked one after the other as their actions end.

    Who has made ``max_cycles`` choices is truncated when it is asked again, and stands still from then on.
    """

    metadata = {"name": "chaic_v0", "render_modes": ["rgb_array"], "is_parallelizable": False}

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> None:
        """Begins an episode, as ``chaic.gym.HelperEnv`` does."""
        self._pair.begin(seed, options)
        self.agents = list(AGENTS)
        self.rewards = dict.fromkeys(AGENTS, 0.0)
        self._cumulative_rewards = dict.fromkeys(AGENTS, 0.0)
        self.terminations = dict.fromkeys(AGENTS, False)
        self.truncations = dict.fromkeys(AGENTS, False)
        self._last = {agent: self._pair.blank() for agent in AGENTS}
        self._choices = dict.fromkeys(AGENTS, 0)
        self.infos: dict[str, dict[str, Any]] = {agent: {} for agent in AGENTS}
        self._go_on()

    def _go_on(self) -> None:
        """Plays until somebody is asked who takes part, and chooses whom; or to the end."""
        asked = self._asked()
        while not asked:
            if self.world.advance() != "waits":
                self._finish()
                return
            asked = self._asked()
            for agent in asked:
                self._ask(agent)
        self.agent_selection = asked[0]

    def _asked(self) -> list[str]:
        """Who is asked now and takes part; those who don't any more stand still."""
        world = self.world
        waiting = world.waiting()
        for number in waiting:
            if AGENTS[number] not in self.agents:
                world.submit({"wait": {"frames": max(1, world.horizon - world.frame)}}, number)
        return [AGENTS[number] for number in waiting if AGENTS[number] in self.agents]

    def _ask(self, agent: str) -> None:
        """Gives an agent what has come of its last choice, and what it perceives."""
        number = AGENTS.index(agent)
        self.rewards[agent] = self._pair.reward(number)
        self._last[agent] = self._pair.observe(number)
        self.infos[agent] = self._pair.info(number, True)
        if self.max_cycles is not None and self._choices[agent] >= self.max_cycles:
            self.truncations[agent] = True

    def _finish(self) -> None:
        """The episode is over for everybody."""
        complete = bool(self.world.score()["complete"])
        for agent in self.agents:
            number = AGENTS.index(agent)
            self.rewards[agent] = self._pair.reward(number)
            self.infos[agent] = self._pair.info(number, False)
            self.terminations[agent], self.truncations[agent] = complete, not complete
        self.agent_selection = self.agents[0]

    def observe(self, agent: str) -> Obs:
        """What an agent perceived when it was last asked."""
        return self._last[agent]

    def step(self, action: Any) -> None:
        """The choice of the agent that is asked; ``None`` for one that takes part no longer."""
        if not self.agents:
            return
        agent = self.agent_selection
        if self.terminations[agent] or self.truncations[agent]:
            self._was_dead_step(action)
            if self.agents and not self.world.is_over:
                self._go_on()
            return
        self._pair.submit(AGENTS.index(agent), action)
        self._choices[agent] += 1
        self._cumulative_rewards[agent] = 0.0
        self._clear_rewards()
        self._go_on()
        self._accumulate_rewards()


class PairParallelEnv(_Interface, ParallelEnv[str, Obs, Any]):
    """Partner and helper in step; whoever is busy waits until it is asked again.

    A step plays on until at least one of them is asked. ``max_cycles`` is a number of steps.
    """

    metadata = {"name": "chaic_parallel_v0", "render_modes": ["rgb_array"]}

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Obs], dict[str, Any]]:
        """Begins an episode, as ``chaic.gym.HelperEnv`` does."""
        self._pair.begin(seed, options)
        self.agents = list(AGENTS)
        self._last = {agent: self._pair.blank() for agent in AGENTS}
        self._steps = 0
        asked = self._go_on()
        return dict(self._last), self._infos(asked)

    def _go_on(self) -> list[int]:
        """Plays on, and lets those look who are asked; nobody is at the end."""
        asked = self.world.waiting() if self.world.advance() == "waits" else []
        for number in asked:
            self._last[AGENTS[number]] = self._pair.observe(number)
        return asked

    def _infos(self, asked: Sequence[int]) -> dict[str, Any]:
        return {a: self._pair.info(k, k in asked) for k, a in enumerate(AGENTS)}

    def step(
        self, actions: dict[str, Any]
    ) -> tuple[
        dict[str, Obs], dict[str, float], dict[str, bool], dict[str, bool], dict[str, Any]
    ]:
        """Everybody's choices; those of busy agents aren't looked at."""
        if not self.agents:
            return {}, {}, {}, {}, {}
        for number in self.world.waiting():
            self._pair.submit(number, actions[AGENTS[number]])
        asked = self._go_on()
        self._steps += 1
        over = not asked
        complete = bool(self.world.score()["complete"])
        cut = self.max_cycles is not None and self._steps >= self.max_cycles
        settled = range(len(AGENTS)) if over else asked
        rewards = dict.fromkeys(AGENTS, 0.0)
        rewards |= {AGENTS[number]: self._pair.reward(number) for number in settled}
        terminations = dict.fromkeys(AGENTS, over and complete)
        truncations = dict.fromkeys(AGENTS, not (over and complete) and (over or cut))
        if over or cut:
            self.agents = []
        return dict(self._last), rewards, terminations, truncations, self._infos(asked)


def env(task: str | Sequence[str] | None = None, **options: Any) -> PairEnv:
    """Partner and helper of a task, asked as their actions end; options as ``chaic.gym.HelperEnv``."""
    return PairEnv(task, **options)


def parallel_env(task: str | Sequence[str] | None = None, **options: Any) -> PairParallelEnv:
    """The same in step."""
    return PairParallelEnv(task, **options)
