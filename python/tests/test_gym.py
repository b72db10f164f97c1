"""The interfaces of Gymnasium."""

import os
import signal
import time

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import chaic
from chaic.registry import ALL, IDS
from chaic.vector import HelperVectorEnv


def test_every_task_has_a_name():
    assert list(IDS) == chaic.tasks()
    assert set(IDS.values()) | {ALL} <= set(gymnasium.registry)


@pytest.mark.parametrize("name", [*IDS.values(), ALL])
def test_gymnasium_finds_nothing_wrong(name):
    env = gymnasium.make(name, image_size=32, render_mode="rgb_array")
    check_env(env.unwrapped)
    env.close()


@pytest.mark.parametrize(
    "options",
    [
        {"observation": "own"},
        {"observation": ("rgb", "depth", "ids", "own", "map"), "grants": ["ids"]},
        {"action": "plan", "observation": ("own", "map")},
        {"action": "plan", "perception": "learned", "image_size": 64},
    ],
)
def test_gymnasium_finds_nothing_wrong_with_other_observations(options):
    env = gymnasium.make(IDS["shopping"], **{"image_size": 32, "render_mode": "ansi", **options})
    check_env(env.unwrapped)


def test_an_episode_by_plans_ends_at_its_horizon_with_its_score():
    env = gymnasium.make(IDS["no_constraint"], action="plan", observation="own")
    _, info = env.reset(seed=3)
    ended, frames, reward = False, 0, 0.0
    while not ended:
        action = int(np.flatnonzero(info["action_mask"])[-1])
        observation, r, terminated, truncated, info = env.step(action)
        assert env.observation_space.contains(observation)
        reward += r
        frames += info["frames"]
        ended = terminated or truncated
    assert truncated != terminated
    assert truncated == (frames >= env.unwrapped.world.horizon)
    assert 0.0 <= info["tr"] <= 1.0 and np.isfinite(reward)
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.unwrapped.step(action)


def test_mistakes_are_told():
    env = gymnasium.make(IDS["obstacle"], image_size=32, disable_env_checker=True).unwrapped
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step([0, 0, 0])
    _, info = env.reset(seed=0)
    assert env.action_space.contains(env.action_space.sample(mask=info["action_mask"]))
    for wrong in ([0, 0], [99, 0, 0], [0, 0, 32], [0.5, 0, 0], None, np.full(3, np.nan)):
        with pytest.raises(ValueError):
            env.step(wrong)
    with pytest.raises(ValueError):
        gymnasium.make(IDS["obstacle"], observation="smell")
    with pytest.raises(ValueError):
        gymnasium.make(IDS["obstacle"], action="dance")
    with pytest.raises(ValueError):
        gymnasium.make(IDS["obstacle"], reward={"fame": 1.0})


def make(n: int = 3, **options) -> HelperVectorEnv:
    env = gymnasium.make_vec(
        ALL,
        num_envs=n,
        vectorization_mode="vector_entry_point",
        **{"image_size": 32, **options},
    )
    return env.unwrapped


def test_each_world_of_a_vector_plays_as_it_does_alone():
    vector = make(copy=True)
    together, _ = vector.reset(seed=5)
    singles = [gymnasium.make(ALL, image_size=32).unwrapped for _ in range(3)]
    for k, env in enumerate(singles):
        env.np_random = np.random.default_rng(5 + k)
        alone, _ = env.reset()
        for part, array in together.items():
            assert (array[k] == alone[part]).all(), part
    rng = np.random.default_rng(0)
    for _ in range(12):
        actions = np.stack([rng.integers(0, [11, 32, 32]) for _ in range(3)])
        together, rewards, _, _, infos = vector.step(actions)
        for k, env in enumerate(singles):
            alone, reward, _, _, info = env.step(actions[k])
            assert (together["rgb"][k] == alone["rgb"]).all()
            assert rewards[k] == pytest.approx(reward)
            assert infos["frames"][k] == info["frames"]
            assert (infos["kind_mask"][k] == info["action_mask"][0]).all()


@pytest.mark.parametrize("mode", ["NextStep", "SameStep", "Disabled"])
def test_worlds_begin_anew_in_each_autoreset_mode(mode):
    vector = make(2, autoreset_mode=mode, observation="own")
    vector.reset(seed=1)
    # Waiting passes the time soonest.
    wait = np.tile([chaic.ACTIONS.index("wait"), 0, 0], (2, 1))
    for _ in range(2000):
        observation, _, terminated, truncated, infos = vector.step(wait)
        if (terminated | truncated).any():
            break
    else:
        pytest.fail("no episode ended")
    over = terminated | truncated
    if mode == "Disabled":
        with pytest.raises(gymnasium.error.ResetNeeded):
            vector.step(wait)
        vector.reset(options={"reset_mask": over})
    elif mode == "SameStep":
        assert (infos["final_info"]["frame"][over] > 1000).all()
        assert infos["_final_obs"].tolist() == over.tolist()
        assert (infos["frame"][over] < 100).all()
    else:
        observation, rewards, terminated, truncated, infos = vector.step(wait)
        assert not (terminated | truncated)[over].any() and (rewards[over] == 0.0).all()
        assert (infos["frame"][over] < 100).all() and (infos["frames"][over] == 0).all()
    observation, *_ = vector.step(wait)
    assert vector.observation_space.contains(observation)


def test_a_vector_writes_into_arrays_that_are_given():
    out = {"rgb": np.zeros((2, 32, 32, 3), np.uint8), "own": np.zeros((2, 12), np.float32)}
    vector = make(2, observation=("rgb", "own"), out=out)
    observation, _ = vector.reset(seed=0)
    assert np.shares_memory(observation["rgb"], out["rgb"]) and out["rgb"].max() > 0
    with pytest.raises(ValueError, match="expected"):
        make(2, observation="rgb", out={"rgb": np.zeros((2, 32, 32), np.uint8)})
    with pytest.raises(ValueError, match="C-contiguous"):
        make(2, observation="rgb", out={"rgb": np.zeros((2, 32, 32, 6), np.uint8)[..., ::2]})


def test_mistakes_with_vectors_are_told():
    vector = make(2)
    with pytest.raises(gymnasium.error.ResetNeeded):
        vector.step(np.zeros((2, 3), int))
    vector.reset(seed=0)
    for wrong in (np.zeros((3, 3), int), np.zeros((2, 3)), np.full((2, 3), 99), np.full((2, 3), -1)):
        with pytest.raises(ValueError):
            vector.step(wrong)
    with pytest.raises(ValueError):
        make(0)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system doesn't fork")
@pytest.mark.filterwarnings("ignore:This process .* is multi-threaded")
def test_a_forked_process_goes_on():
    vector = make(2)
    vector.reset(seed=0)
    wait = np.tile([chaic.ACTIONS.index("wait"), 0, 0], (2, 1))
    vector.step(wait)
    child = os.fork()
    if child == 0:
        vector.step(wait)
        make(2).reset(seed=1)
        try:
            chaic.evaluate({"nobody": object}, quiet=True)
        except RuntimeError as error:
            os._exit(0 if "spawn" in str(error) else 1)
        os._exit(2)
    deadline = time.monotonic() + 60
    while (ended := os.waitpid(child, os.WNOHANG)) == (0, 0):
        if time.monotonic() > deadline:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            pytest.fail("the child hangs")
        time.sleep(0.05)
    assert ended[1] == 0


def test_environments_in_processes_of_their_own():
    for context in ("spawn", "fork"):
        envs = gymnasium.make_vec(
            IDS["obstacle"],
            num_envs=2,
            vectorization_mode="async",
            vector_kwargs={"context": context},
            image_size=32,
        )
        observation, _ = envs.reset(seed=0)
        envs.step(np.zeros((2, 3), np.int64))
        envs.close()
        assert observation["rgb"].shape == (2, 32, 32, 3)
