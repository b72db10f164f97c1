"""Vector environment of helpers: one call steps all worlds on all cores and renders all observations in one batch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from chaic import _deprecated, spaces
from chaic._chaic import ACTIONS, PROPRIOCEPTION, Batch, Episode, World
from chaic._recreated import Recreated
from chaic.episodes import EpisodeSource
from chaic.gym import reward_weights

Arrays = dict[str, NDArray[Any]]

#: Parts of an observation that a vector environment supports.
PARTS = ("rgb", "depth", "ids", "proprioception")
#: Maximum number of worlds. Each takes about 3 MB, all of them 50 GB.
MAX_ENVS = 1 << 14
#: Maximum number of pixels of all worlds. Each takes about 34 bytes for color and depth, all of them 36 GB.
MAX_PIXELS = 1 << 30


class HelperVectorEnv(Recreated, VectorEnv[Arrays, Any, Any]):
    """Helpers in ``num_envs`` worlds, each with its simulated partner. Options as in ``chaic.gym.HelperEnv``, without
    ``action`` and ``perception``: actions are primitive, and an observation has no ``map``.

    The final observation of an episode is that of the last decision. ``copy=False`` is faster: each step then overwrites the
    arrays of the last observation. ``out`` maps parts of the observation to arrays to write into: NumPy arrays, or objects
    with DLPack or the buffer protocol. ``copy`` is false by default with ``out``, and true without.

    ``infos["kind_mask"]`` masks the kinds of action. A world that has ended keeps the mask of its last decision.
    """

    metadata = {"render_modes": ["rgb_array"], "autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(
        self,
        task: str | Sequence[str] | None = None,
        num_envs: int = 1,
        *,
        split: str | None = None,
        observation: Sequence[str] = spaces.DEFAULT_PARTS,
        image_size: int = 128,
        grants: Sequence[str] = (),
        rules: str = "paper",
        set: Sequence[str] = (),
        appearance: str = "canonical",
        partner_image_size: int | None = None,
        reward: Mapping[str, float] | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        copy: bool | None = None,
        out: Mapping[str, Any] | None = None,
        render_mode: str | None = None,
        minds_image_size: int | None = None,
    ) -> None:
        partner_image_size = _deprecated.partner_image_size(partner_image_size, minds_image_size)
        if not 1 <= num_envs <= MAX_ENVS:
            raise ValueError(f"num_envs is {num_envs}, expected 1 to {MAX_ENVS}")
        self.parts = spaces.parse_parts(observation)
        for part in self.parts:
            if part not in PARTS:
                raise ValueError(
                    f"a vector environment has no part {part!r}; the parts are {', '.join(PARTS)}"
                )
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise ValueError(f'unknown render mode {render_mode!r}; the mode is "rgb_array"')
        if render_mode is not None and "rgb" not in self.parts:
            raise ValueError('render_mode "rgb_array" returns the color images of the observation; add "rgb" to it')
        self.num_envs = num_envs
        self.render_mode = render_mode
        self.weights = reward_weights(reward)
        self.source = EpisodeSource(task, split)
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.metadata = {**self.metadata, "autoreset_mode": self.autoreset_mode}
        self.copy = out is None if copy is None else copy
        self._options: dict[str, Any] = {
            "images": spaces.image_parts(self.parts),
            "image_size": image_size,
            "grants": grants if isinstance(grants, str) else list(grants),
            "rules": rules,
            "set": set if isinstance(set, str) else list(set),
            "appearance": appearance,
            "partner_image_size": partner_image_size,
        }
        # Invalid options raise an error here, not in the first reset.
        World(self.source.get(self.source.ids[0]), 0, **self._options)
        if spaces.image_parts(self.parts) and num_envs * image_size**2 > MAX_PIXELS:
            raise ValueError(
                f"{num_envs} images of {image_size}x{image_size} pixels need too much memory; num_envs is at most "
                f"{MAX_PIXELS // image_size**2} at this image_size"
            )
        self._single = spaces.observation_space(self.parts, image_size)
        self._actions = spaces.primitive_space(image_size)
        self.single_observation_space = self._single
        self.single_action_space = self._actions
        self.observation_space = batch_space(self._single, num_envs)
        self.action_space = batch_space(self._actions, num_envs)
        self._arrays = self._create_arrays(out or {})
        self._mask = np.ones((num_envs, len(ACTIONS)), bool)
        #: Worlds; ``None`` before the first reset.
        self.batch: Batch | None = None
        self._rngs: list[np.random.Generator] = []
        self._episode_ids: list[str] = [""] * num_envs
        #: Mask of the worlds whose episode has ended.
        self._ended = np.zeros(num_envs, bool)

    def _create_arrays(self, out: Mapping[str, Any]) -> Arrays:
        arrays: Arrays = {}
        for part, space in self._single.spaces.items():
            shape = (self.num_envs, *(space.shape or ()))
            target = out.get(part)
            array = np.zeros(shape, space.dtype) if target is None else _as_array(target)
            if array.shape != shape or array.dtype != space.dtype:
                raise ValueError(
                    f"out[{part!r}] is {array.dtype} {array.shape}, expected {space.dtype} {shape}"
                )
            if not array.flags.writeable or not array.flags.c_contiguous:
                raise ValueError(f"out[{part!r}] must be writable and C-contiguous")
            arrays[part] = array
        for part in out:
            if part not in arrays:
                raise ValueError(f"the observation has no part {part!r}")
        # The batch writes proprioception together with the action mask, even if it is not part of the observation.
        self._proprioception = arrays.get("proprioception", np.zeros((self.num_envs, len(PROPRIOCEPTION)), np.float32))
        return arrays

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Arrays, dict[str, Any]]:
        """Starts episodes in all worlds, or in those of ``options["reset_mask"]``."""
        mask = np.ones(self.num_envs, bool)
        if unknown := set(options or ()) - {"reset_mask"}:
            raise ValueError(f"a vector environment has no reset option {sorted(unknown)}; it has reset_mask")
        if options is not None and "reset_mask" in options:
            mask = np.asarray(options["reset_mask"])
            if mask.shape != (self.num_envs,) or mask.dtype != np.bool_:
                raise ValueError(f"reset_mask is {mask.dtype} {mask.shape}, expected bool ({self.num_envs},)")
        self._seed(seed, mask)
        if self.batch is None:
            if not mask.all():
                raise ValueError("the first reset must include all worlds")
            drawn = [self.source.draw(rng) for rng in self._rngs]
            episodes, seeds = [episode for episode, _ in drawn], [seed for _, seed in drawn]
            self.batch = Batch(episodes, seeds, **self._options)
            self._episode_ids = [episode.id for episode in episodes]
        else:
            self._start_episodes(np.flatnonzero(mask))
        self._ended[mask] = False
        self._advance()
        return self._observe(), self._infos(np.zeros(self.num_envs, np.int64))

    def _seed(self, seed: int | Sequence[int | None] | None, mask: NDArray[np.bool_]) -> None:
        seeds: list[int | None]
        if seed is None:
            seeds = [None] * self.num_envs
        elif isinstance(seed, (int, np.integer)):
            seeds = [int(seed) + k for k in range(self.num_envs)]
        else:
            seeds = list(seed)
        if len(seeds) != self.num_envs:
            raise ValueError(f"{len(seeds)} seeds for {self.num_envs} worlds")
        if not self._rngs:
            self._rngs = [np.random.default_rng(seed) for seed in seeds]
            return
        for k, one in enumerate(seeds):
            if one is not None and mask[k]:
                self._rngs[k] = np.random.default_rng(one)

    def _start_episodes(self, worlds: NDArray[np.int64]) -> None:
        """Draws an episode for each of these worlds and starts it."""
        assert self.batch is not None
        if len(worlds) == 0:
            return
        episodes: list[Episode] = []
        seeds: list[int] = []
        for k in worlds:
            episode, seed = self.source.draw(self._rngs[k])
            self._episode_ids[k] = episode.id
            episodes.append(episode)
            seeds.append(seed)
        self.batch.reset([int(k) for k in worlds], episodes, seeds)

    def _advance(self) -> None:
        """Advances all worlds, and renders the images of those that start a turn."""
        assert self.batch is not None
        images = {part: self._arrays[part] for part in spaces.image_parts(self.parts)}
        self._ended |= self.batch.advance_and_observe(**images) == 1

    def _observe(self) -> Arrays:
        assert self.batch is not None
        self.batch.proprioception(self._proprioception, self._mask)
        if self.copy:
            return {part: array.copy() for part, array in self._arrays.items()}
        return dict(self._arrays)

    def _infos(self, frames: NDArray[np.int64]) -> dict[str, Any]:
        assert self.batch is not None
        delivered, wanted = self.batch.progress().T
        tr = np.divide(delivered, wanted, out=np.zeros_like(delivered), where=wanted > 0)
        all_worlds = np.ones(self.num_envs, bool)
        infos: dict[str, Any] = {
            "frames": frames,
            "frame": self.batch.frames().astype(np.int64),
            "kind_mask": self._mask.astype(np.int8),
            "tr": tr,
            "episode_id": np.array(self._episode_ids, dtype=object),
        }
        return infos | {f"_{name}": all_worlds for name in infos}

    def step(
        self, actions: Any
    ) -> tuple[
        Arrays, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]
    ]:
        """Executes one decision in each world and advances all worlds to the next one."""
        if self.batch is None:
            raise gymnasium.error.ResetNeeded("reset the environment before its first step")
        rows = self._parse_actions(actions)
        ended_before = self._ended.copy()
        next_step = self.autoreset_mode == AutoresetMode.NEXT_STEP
        if ended_before.any() and self.autoreset_mode == AutoresetMode.DISABLED:
            raise gymnasium.error.ResetNeeded("an episode is over; reset it with options['reset_mask']")
        before = self.batch.frames().astype(np.int64)
        if next_step and ended_before.any():
            # This step starts a new episode in the worlds that have ended and ignores their actions.
            worlds = np.flatnonzero(ended_before)
            self._start_episodes(worlds)
            self._ended[worlds] = False
            before[worlds] = 0
        self.batch.submit(rows)
        self._advance()
        frames = self.batch.frames().astype(np.int64) - before
        rewards = self.batch.rewards(self.weights)
        ended = self._ended & ~ended_before if next_step else self._ended.copy()
        delivered, wanted = self.batch.progress().T
        terminations = ended & (delivered >= wanted)
        truncations = ended & ~terminations
        if next_step:
            rewards[ended_before] = 0.0
            frames[ended_before] = 0
        if self.autoreset_mode == AutoresetMode.SAME_STEP and ended.any():
            return self._same_step(ended, frames, rewards, terminations, truncations)
        return self._observe(), rewards, terminations, truncations, self._infos(frames)

    def _same_step(
        self,
        ended: NDArray[np.bool_],
        frames: NDArray[np.int64],
        rewards: NDArray[np.float64],
        terminations: NDArray[np.bool_],
        truncations: NDArray[np.bool_],
    ) -> tuple[
        Arrays, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]
    ]:
        """Starts new episodes in the worlds that have ended; the infos contain the final observations and infos."""
        last = self._infos(frames)
        worlds = np.flatnonzero(ended)
        final_obs = np.full(self.num_envs, None, dtype=object)
        for k in worlds:
            final_obs[k] = {part: array[k].copy() for part, array in self._arrays.items()}
        self._start_episodes(worlds)
        self._ended[worlds] = False
        self._advance()
        observation = self._observe()
        infos = self._infos(frames)
        infos["final_obs"], infos["_final_obs"] = final_obs, ended
        final_info = {name: values for name, values in last.items() if not name.startswith("_")}
        final_info |= {f"_{name}": ended for name in list(final_info)}
        infos["final_info"], infos["_final_info"] = final_info, ended
        return observation, rewards, terminations, truncations, infos

    def _parse_actions(self, actions: Any) -> NDArray[np.int64]:
        rows = np.asarray(actions)
        shape = (self.num_envs, 3)
        if rows.shape != shape or rows.dtype.kind not in "iu":
            raise ValueError(f"actions are {rows.dtype} {rows.shape}, expected integers {shape}")
        high = self._actions.nvec
        if (rows < 0).any() or (rows >= high).any():
            raise ValueError(f"an action is not in {self._actions}")
        return np.ascontiguousarray(rows, np.int64)

    def render(self) -> Any:
        """Returns the current color image of each helper."""
        if self.render_mode == "rgb_array":
            return tuple(self._arrays["rgb"].copy())
        return None


def _as_array(target: Any) -> NDArray[Any]:
    """Returns an array that shares the memory of ``target``."""
    if isinstance(target, np.ndarray):
        return target
    if hasattr(target, "__array__"):
        arrays = np.asarray(target), np.asarray(target)
        # Equal addresses mean that no copy was made. An array of NumPy's DLPack can be read-only.
        if arrays[0].ctypes.data == arrays[1].ctypes.data:
            return arrays[0]
    if hasattr(target, "__dlpack__"):
        return np.from_dlpack(target)
    return np.asarray(memoryview(target))


