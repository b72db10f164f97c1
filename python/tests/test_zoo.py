"""The interfaces of PettingZoo, held to its own tests."""

import warnings

import numpy as np
import pytest

from chaic import zoo

OPTIONS = {"image_size": 32, "observation": ("rgb", "own")}

with warnings.catch_warnings():
    # What PettingZoo's own tests import.
    warnings.simplefilter("ignore")
    from pettingzoo.test import api_test, max_cycles_test, parallel_api_test, seed_test


# It says so of every environment with observations that are dictionaries and actions of several numbers.
@pytest.mark.filterwarnings("ignore:Observation space for each agent probably")
@pytest.mark.filterwarnings("ignore:Action space for each agent probably")
@pytest.mark.filterwarnings("ignore:We recommend agents to be named")
@pytest.mark.filterwarnings("ignore:Observation is not a NumPy array")
def test_pettingzoo_finds_nothing_wrong():
    api_test(zoo.env("high_goal", **OPTIONS), num_cycles=60)
    parallel_api_test(zoo.parallel_env("high_goal", **OPTIONS), num_cycles=60)


def test_the_same_seed_gives_the_same_episode():
    seed_test(lambda: zoo.env("obstacle", **OPTIONS), num_cycles=30)


def test_episodes_can_be_cut():
    class Module:
        @staticmethod
        def env(**options):
            return zoo.env("obstacle", **OPTIONS, **options)

        @staticmethod
        def parallel_env(**options):
            return zoo.parallel_env("obstacle", **OPTIONS, **options)

    max_cycles_test(Module)


def test_whoever_has_ended_is_next():
    env = zoo.env("low_target", **OPTIONS)
    env.reset(seed=1)
    asked = []
    for agent in env.agent_iter(max_iter=60):
        frame = env.world.frame
        # The partner waits for long, the helper for a moment.
        asked.append((agent, frame))
        env.step(np.array([10 if agent == "helper" else 0, 0, 0]))
    assert [frame for _, frame in asked] == sorted(frame for _, frame in asked)
    assert {agent for agent, _ in asked} == set(zoo.AGENTS)


def test_a_busy_agent_waits_in_step():
    env = zoo.parallel_env("low_target", **OPTIONS)
    _, infos = env.reset(seed=1)
    assert all(info["asked"] for info in infos.values())
    asked = []
    for _ in range(20):
        actions = {"partner": np.array([0, 0, 0]), "helper": np.array([10, 0, 0])}
        observations, _, _, _, infos = env.step(actions)
        assert all(env.observation_space(a).contains(o) for a, o in observations.items())
        asked.append(tuple(infos[agent]["asked"] for agent in zoo.AGENTS))
    assert all(any(who) for who in asked) and not all(all(who) for who in asked)


def test_mistakes_are_told():
    env = zoo.env("obstacle", **OPTIONS)
    env.reset(seed=0)
    with pytest.raises(ValueError):
        env.step(np.array([99, 0, 0]))
    with pytest.raises(ValueError):
        zoo.env("obstacle", observation="map")
