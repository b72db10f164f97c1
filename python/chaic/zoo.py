"""PettingZoo environments of partner and helper; learners or people can control either of them.

``env`` is an AEC environment, which matches chaic's timing: the agent whose action has ended is next. ``parallel_env`` is for
algorithms that step all agents at once. There an agent whose earlier action has not ended keeps its last observation, its
``info["needs_action"]`` is 0, and its new action is ignored.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray
from pettingzoo import AECEnv, ParallelEnv

from chaic import _deprecated, spaces
from chaic._chaic import ACTIONS, World, weigh_reward
from chaic._recreated import Recreated
from chaic.episodes import EpisodeSource
from chaic.gym import PICTURE_SIZE, Obs, reward_weights

#: Names of the agents, in the order of their ids in a world.
AGENTS: tuple[str, ...] = ("partner", "helper")


def _copy(observation: Obs) -> Obs:
    """Returns a copy that the caller may change."""
    return {part: array.copy() for part, array in observation.items()}


class _Info(dict[str, Any]):
    """Info of an agent; accepts the deprecated key ``asked``."""

    def __missing__(self, key: str) -> Any:
        if key != "asked":
            raise KeyError(key)
        _deprecated.warn('info["asked"]', 'info["needs_action"]')
        return self["needs_action"]


class _Pair:
    """World with two agents of the caller; both environments use it."""

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
        self.parts = spaces.parse_parts(observation)
        if "map" in self.parts:
            raise ValueError("an environment with two agents has no part 'map'")
        self.weights = reward_weights(reward)
        self.source = EpisodeSource(task, split)
        self.image_size = image_size
        self._options: dict[str, Any] = {
            "partner": "caller",
            "images": spaces.image_parts(self.parts),
            "image_size": image_size,
            "grants": grants if isinstance(grants, str) else list(grants),
            "rules": rules,
            "set": set if isinstance(set, str) else list(set),
            "appearance": appearance,
        }
        self._world: World | None = None
        self._rng = np.random.default_rng()
        World(self.source.get(self.source.ids[0]), 0, **self._options)

    @property
    def world(self) -> World:
        if self._world is None:
            raise gymnasium.error.ResetNeeded("reset the environment before its first step")
        return self._world

    def start_episode(self, seed: int | None, options: dict[str, Any] | None) -> None:
        if seed is not None:
            self._rng = np.random.default_rng(seed)
        episode, world_seed = self.source.choose(self._rng, options)
        if self._world is None:
            self._world = World(episode, world_seed, **self._options)
        else:
            self._world.reset(episode, world_seed)

    def observe(self, agent: int) -> Obs:
        observation = self.world.observe(agent)
        return {
            part: self.world.proprioception(agent)[0] if part == "proprioception" else getattr(observation, part)
            for part in self.parts
        }

    def zero_observation(self) -> Obs:
        space = self.observation_space()
        return {name: np.zeros(s.shape or (), s.dtype) for name, s in space.spaces.items()}

    def observation_space(self) -> gymnasium.spaces.Dict:
        return spaces.observation_space(self.parts, self.image_size)

    def parse(self, action: Any) -> list[int]:
        return spaces.parse_row(action, (len(ACTIONS), self.image_size, self.image_size))

    def reward(self, agent: int) -> float:
        terms = self.world.reward(agent)
        return 0.0 if terms is None else weigh_reward(**terms, weights=self.weights)

    def info(self, agent: int, needs_action: bool) -> dict[str, Any]:
        world = self.world
        score = world.score()
        kinds: NDArray[Any] = world.proprioception(agent)[1] if needs_action else np.zeros(len(ACTIONS), bool)
        return _Info(
            needs_action=int(needs_action),
            frame=world.frame,
            action_mask=spaces.primitive_mask(kinds, self.image_size),
            tr=score["delivered"] / score["wanted"] if score["wanted"] else 0.0,
            episode_id=world.episode.id,
        )


class _PairBase(Recreated):
    """Options, spaces and rendering of both environments."""

    metadata: dict[str, Any]

    def __init__(
        self,
        task: str | Sequence[str] | None = None,
        *,
        split: str | None = None,
        observation: Sequence[str] = spaces.DEFAULT_PARTS,
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
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise ValueError(f'unknown render mode {render_mode!r}; the mode is "rgb_array"')
        if max_cycles is not None and max_cycles < 1:
            raise ValueError(f"max_cycles is {max_cycles}, expected at least 1")
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
        """Returns the observation space of an agent."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> gymnasium.Space[Any]:
        """Returns the action space of an agent."""
        return self.action_spaces[agent]

    @property
    def world(self) -> World:
        """World of both agents."""
        return self._pair.world

    def render(self) -> Any:
        """Renders the helper's view, uint8 [512, 512, 3]."""
        if self.render_mode != "rgb_array":
            return None
        return self.world.render(1, image_size=PICTURE_SIZE)["rgb"]

    def close(self) -> None:
        """Does nothing; the environment holds no resources."""


class PairEnv(_PairBase, AECEnv[str, Obs, Any]):
    """AEC environment of partner and helper: the agent whose action has ended is next.

    An agent that has submitted ``max_cycles`` actions is truncated when it needs the next one, and waits from then on.
    """

    metadata = {"name": "chaic_v0", "render_modes": ["rgb_array"], "is_parallelizable": False}

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> None:
        """Starts an episode, as ``chaic.gym.HelperEnv`` does."""
        self._pair.start_episode(seed, options)
        self.agents = list(AGENTS)
        self.rewards = dict.fromkeys(AGENTS, 0.0)
        self._cumulative_rewards = dict.fromkeys(AGENTS, 0.0)
        self.terminations = dict.fromkeys(AGENTS, False)
        self.truncations = dict.fromkeys(AGENTS, False)
        self._last = {agent: self._pair.zero_observation() for agent in AGENTS}
        self._n_actions = dict.fromkeys(AGENTS, 0)
        self.infos: dict[str, dict[str, Any]] = {agent: {} for agent in AGENTS}
        self._advance()

    def _advance(self) -> None:
        """Advances until an active agent needs an action, and selects it; or until the episode ends."""
        waiting = self._waiting()
        while not waiting:
            if self.world.advance() != "needs_action":
                self._finish()
                return
            waiting = self._waiting()
            for agent in waiting:
                self._update(agent)
        self.agent_selection = waiting[0]

    def _waiting(self) -> list[str]:
        """Returns the active agents that need an action; submits a wait for agents that are no longer active."""
        world = self.world
        waiting = world.waiting()
        for agent_id in waiting:
            if AGENTS[agent_id] not in self.agents:
                world.submit({"wait": {"frames": max(1, world.horizon - world.frame)}}, agent_id)
        return [AGENTS[agent_id] for agent_id in waiting if AGENTS[agent_id] in self.agents]

    def _update(self, agent: str) -> None:
        """Stores the reward of an agent's last action and its new observation."""
        agent_id = AGENTS.index(agent)
        self.rewards[agent] = self._pair.reward(agent_id)
        self._last[agent] = self._pair.observe(agent_id)
        self.infos[agent] = self._pair.info(agent_id, True)
        if self.max_cycles is not None and self._n_actions[agent] >= self.max_cycles:
            self.truncations[agent] = True

    def _finish(self) -> None:
        """Ends the episode for all agents."""
        complete = bool(self.world.score()["complete"])
        for agent in self.agents:
            agent_id = AGENTS.index(agent)
            self.rewards[agent] = self._pair.reward(agent_id)
            self.infos[agent] = self._pair.info(agent_id, False)
            self.terminations[agent], self.truncations[agent] = complete, not complete
        self.agent_selection = self.agents[0]

    def observe(self, agent: str) -> Obs:
        """Returns the observation of an agent when it last needed an action."""
        return _copy(self._last[agent])

    def step(self, action: Any) -> None:
        """Submits the action of the selected agent; ``None`` for an agent that has ended."""
        world = self.world
        if not self.agents:
            return
        agent = self.agent_selection
        if self.terminations[agent] or self.truncations[agent]:
            self._was_dead_step(action)
            if self.agents and not world.is_over:
                self._advance()
                self._accumulate_rewards()
            return
        world.submit(self._pair.parse(action), AGENTS.index(agent))
        self._n_actions[agent] += 1
        self._cumulative_rewards[agent] = 0.0
        self._clear_rewards()
        self._advance()
        self._accumulate_rewards()


class PairParallelEnv(_PairBase, ParallelEnv[str, Obs, Any]):
    """Parallel environment of partner and helper; actions of a busy agent are ignored.

    A step advances until at least one agent needs an action. ``max_cycles`` is a number of steps.
    """

    metadata = {"name": "chaic_parallel_v0", "render_modes": ["rgb_array"]}

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Obs], dict[str, Any]]:
        """Starts an episode, as ``chaic.gym.HelperEnv`` does."""
        self._pair.start_episode(seed, options)
        self.agents = list(AGENTS)
        self._last = {agent: self._pair.zero_observation() for agent in AGENTS}
        self._steps = 0
        waiting = self._advance()
        return self._observations(), self._infos(waiting)

    def _advance(self) -> list[int]:
        """Advances, observes for the agents that need an action, and returns their ids; none at the end."""
        waiting = self.world.waiting() if self.world.advance() == "needs_action" else []
        for agent_id in waiting:
            self._last[AGENTS[agent_id]] = self._pair.observe(agent_id)
        return waiting

    def _observations(self) -> dict[str, Obs]:
        return {agent: _copy(observation) for agent, observation in self._last.items()}

    def _infos(self, waiting: Sequence[int]) -> dict[str, Any]:
        return {a: self._pair.info(k, k in waiting) for k, a in enumerate(AGENTS)}

    def step(
        self, actions: dict[str, Any]
    ) -> tuple[
        dict[str, Obs], dict[str, float], dict[str, bool], dict[str, bool], dict[str, Any]
    ]:
        """Submits the actions of all agents and advances; actions of busy agents are ignored."""
        world = self.world
        if not self.agents:
            return {}, {}, {}, {}, {}
        # All actions are checked before the first is submitted, so an invalid one changes nothing.
        rows = [(agent_id, self._pair.parse(actions[AGENTS[agent_id]])) for agent_id in world.waiting()]
        for agent_id, row in rows:
            world.submit(row, agent_id)
        waiting = self._advance()
        self._steps += 1
        ended = not waiting
        complete = bool(world.score()["complete"])
        is_cut = self.max_cycles is not None and self._steps >= self.max_cycles
        # The last step returns the reward that a running action has earned so far.
        rewarded = range(len(AGENTS)) if ended or is_cut else waiting
        rewards = dict.fromkeys(AGENTS, 0.0)
        rewards |= {AGENTS[agent_id]: self._pair.reward(agent_id) for agent_id in rewarded}
        terminations = dict.fromkeys(AGENTS, ended and complete)
        truncations = dict.fromkeys(AGENTS, not (ended and complete) and (ended or is_cut))
        if ended or is_cut:
            self.agents = []
        return self._observations(), rewards, terminations, truncations, self._infos(waiting)


def env(task: str | Sequence[str] | None = None, **options: Any) -> PairEnv:
    """Returns the AEC environment of a task.

    Options as in ``chaic.gym.HelperEnv``, without ``action``, ``perception`` and ``partner_image_size``; an observation has no
    ``map``. ``max_cycles`` limits the actions of each agent.
    """
    return PairEnv(task, **options)


def parallel_env(task: str | Sequence[str] | None = None, **options: Any) -> PairParallelEnv:
    """Returns the parallel environment of a task; options as in ``env``."""
    return PairParallelEnv(task, **options)
