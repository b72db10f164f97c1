"""PettingZoo environments, checked with the tests of PettingZoo."""

import pickle
import warnings

import gymnasium
import numpy as np
import pytest

import chaic
from chaic import zoo

OPTIONS = {"image_size": 32, "observation": ("rgb", "proprioception")}

with warnings.catch_warnings():
    # Imports of PettingZoo's tests raise warnings.
    warnings.simplefilter("ignore")
    from pettingzoo.test import api_test, max_cycles_test, parallel_api_test, seed_test


# PettingZoo warns about every environment with dictionary observations and multi-discrete actions.
@pytest.mark.filterwarnings("ignore:Observation space for each agent probably")
@pytest.mark.filterwarnings("ignore:Action space for each agent probably")
@pytest.mark.filterwarnings("ignore:We recommend agents to be named")
@pytest.mark.filterwarnings("ignore:Observation is not a NumPy array")
def test_the_pettingzoo_tests_pass():
    api_test(zoo.env("high_goal", **OPTIONS), num_cycles=60)
    parallel_api_test(zoo.parallel_env("high_goal", **OPTIONS), num_cycles=60)


def test_equal_seeds_give_equal_episodes():
    seed_test(lambda: zoo.env("obstacle", **OPTIONS), num_cycles=30)


def test_max_cycles_truncates_an_episode():
    class Module:
        @staticmethod
        def env(**options):
            return zoo.env("obstacle", **OPTIONS, **options)

        @staticmethod
        def parallel_env(**options):
            return zoo.parallel_env("obstacle", **OPTIONS, **options)

    max_cycles_test(Module)


def test_no_reward_is_lost_when_an_agent_ends_early():
    env = zoo.env("obstacle", max_cycles=4, reward={"invalid": 0.0, "progress_per_m": 1.0}, **OPTIONS)
    env.reset(seed=1)
    # The partner uses its empty hands and has ended before the first walk of the helper ends.
    rows = {"partner": [chaic.ACTIONS.index("put_in"), 0, 0], "helper": [chaic.ACTIONS.index("move_forward"), 0, 0]}
    rewards = []
    for agent in env.agent_iter(max_iter=60):
        _, reward, terminated, truncated, _ = env.last()
        rewards.extend([reward] if agent == "helper" else [])
        env.step(None if terminated or truncated else np.array(rows[agent]))
    assert [reward != 0.0 for reward in rewards] == [False, True, True, True, True]


def test_the_last_step_pays_what_a_running_action_has_earned():
    weights = {"invalid": 0.0, "progress_per_m": 1.0}
    rows = {"partner": [chaic.ACTIONS.index("put_in"), 0, 0], "helper": [chaic.ACTIONS.index("move_forward"), 0, 0]}
    env = zoo.parallel_env("obstacle", max_cycles=3, reward=weights, **OPTIONS)
    observations, infos = env.reset(seed=1)
    observations["helper"].clear()
    rewards = []
    while env.agents:
        observations, reward, _, _, infos = env.step({agent: np.array(rows[agent]) for agent in zoo.AGENTS})
        assert set(observations["helper"]) == set(env.observation_space("helper"))
        rewards.append((reward["helper"], infos["helper"]["needs_action"]))
    # The helper still walks at the end.
    assert rewards[-1][1] == 0 and rewards[-1][0] != 0.0, rewards


def test_the_agent_whose_action_ended_is_next():
    env = zoo.env("low_target", **OPTIONS)
    env.reset(seed=1)
    turns = []
    for agent in env.agent_iter(max_iter=60):
        frame = env.world.frame
        turns.append((agent, frame))
        # The helper waits; the partner moves.
        env.step(np.array([10 if agent == "helper" else 0, 0, 0]))
    assert [frame for _, frame in turns] == sorted(frame for _, frame in turns)
    assert {agent for agent, _ in turns} == set(zoo.AGENTS)


def test_a_busy_agent_needs_no_action():
    env = zoo.parallel_env("low_target", **OPTIONS)
    _, infos = env.reset(seed=1)
    assert all(info["needs_action"] for info in infos.values())
    needs_action = []
    for _ in range(20):
        actions = {"partner": np.array([0, 0, 0]), "helper": np.array([10, 0, 0])}
        observations, _, _, _, infos = env.step(actions)
        assert all(env.observation_space(a).contains(o) for a, o in observations.items())
        needs_action.append(tuple(infos[agent]["needs_action"] for agent in zoo.AGENTS))
    assert all(any(step) for step in needs_action)
    assert not all(all(step) for step in needs_action)
    with pytest.warns(DeprecationWarning, match="needs_action"):
        assert infos["helper"]["asked"] == infos["helper"]["needs_action"]


def test_an_invalid_action_submits_none_of_the_others():
    env = zoo.parallel_env("obstacle", **OPTIONS)
    env.reset(seed=0)
    assert env.world.waiting() == [0, 1]
    with pytest.raises(ValueError, match="invalid action"):
        env.step({"partner": np.array([0, 0, 0]), "helper": np.array([99, 0, 0])})
    assert env.world.waiting() == [0, 1]


def test_invalid_arguments_are_refused():
    env = zoo.env("obstacle", **OPTIONS)
    env.reset(seed=0)
    with pytest.raises(ValueError):
        env.step(np.array([99, 0, 0]))
    with pytest.raises(ValueError):
        zoo.env("obstacle", observation="map")
    with pytest.raises(ValueError, match="no rule `nothing`"):
        zoo.env("obstacle", set="nothing=1", **OPTIONS)
    with pytest.raises(ValueError, match="rgb_array"):
        zoo.parallel_env("obstacle", render_mode="human")
    for create in (zoo.env, zoo.parallel_env):
        with pytest.raises(ValueError, match="max_cycles is 0"):
            create("obstacle", max_cycles=0)


def test_a_pickle_is_a_new_environment():
    for create in (zoo.env, zoo.parallel_env):
        env = create("obstacle", max_cycles=7, **OPTIONS)
        env.reset(seed=0)
        again = pickle.loads(pickle.dumps(env))
        assert again.max_cycles == 7 and again.action_spaces == env.action_spaces
        with pytest.raises(gymnasium.error.ResetNeeded):
            again.step({})
        again.reset(seed=0)
        assert again.world.digest() == env.world.digest()
