"""Gymnasium environments."""

import copy
import os
import pickle
import signal
import time

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import chaic
from chaic.gym import HelperEnv, reward_weights
from chaic.registry import ALL, IDS
from chaic.vector import HelperVectorEnv


def test_every_task_has_an_environment_id():
    assert list(IDS) == chaic.tasks()
    assert set(IDS.values()) | {ALL} <= set(gymnasium.registry)


@pytest.mark.parametrize("name", [*IDS.values(), ALL])
def test_the_gymnasium_checker_passes(name):
    env = gymnasium.make(name, image_size=32, render_mode="rgb_array")
    check_env(env.unwrapped)
    env.close()


@pytest.mark.parametrize(
    "options",
    [
        {"observation": "proprioception"},
        {"observation": ("rgb", "depth", "ids", "proprioception", "map"), "grants": ["ids"]},
        {"action": "plan", "observation": ("proprioception", "map")},
        {"action": "plan", "perception": "learned", "image_size": 64},
    ],
)
def test_the_gymnasium_checker_passes_for_other_observations(options):
    env = gymnasium.make(IDS["shopping"], **{"image_size": 32, "render_mode": "ansi", **options})
    check_env(env.unwrapped)


def test_an_episode_of_plans_ends_at_the_horizon_or_when_complete():
    env = gymnasium.make(IDS["no_constraint"], action="plan", observation="proprioception")
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


def test_invalid_arguments_are_refused():
    env = gymnasium.make(IDS["obstacle"], image_size=32, disable_env_checker=True).unwrapped
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step([0, 0, 0])
    _, info = env.reset(seed=0)
    assert env.action_space.contains(env.action_space.sample(mask=info["action_mask"]))
    for invalid in ([0, 0], [99, 0, 0], [0, 0, 32], [0.5, 0, 0], None, np.full(3, np.nan)):
        with pytest.raises(ValueError):
            env.step(invalid)
    for seed in (-1, 2**32, 1.5, "a"):
        with pytest.raises(ValueError, match="option seed"):
            env.reset(options={"seed": seed})
    with pytest.raises(ValueError, match="no reset option .*episodes"):
        env.reset(options={"episodes": "obstacle/train/03"})
    with pytest.raises(ValueError):
        gymnasium.make(IDS["obstacle"], observation="smell")
    with pytest.raises(ValueError):
        gymnasium.make(IDS["obstacle"], action="dance")
    with pytest.raises(ValueError):
        gymnasium.make(IDS["obstacle"], reward={"fame": 1.0})
    with pytest.raises(ValueError, match="expected a finite number"):
        gymnasium.make(IDS["obstacle"], reward={"delivered": float("nan")})


@pytest.mark.parametrize(
    "options",
    [
        {"image_size": 0},
        {"grants": "gold"},
        {"rules": "papr"},
        {"set": "nothing=1"},
        {"appearance": "sepia"},
        {"partner_image_size": 5},
    ],
)
def test_all_environments_refuse_invalid_options_at_construction(options):
    messages = set()
    for create in (HelperEnv, HelperVectorEnv):
        with pytest.raises(ValueError) as raised:
            create("obstacle", **options)
        messages.add(str(raised.value))
    assert len(messages) == 1


def test_one_setting_may_be_a_string():
    for create in (HelperEnv, HelperVectorEnv):
        create("obstacle", observation="proprioception", set="world.stride_m=0.3")
        with pytest.raises(ValueError, match="no rule `nothing`"):
            create("obstacle", observation="proprioception", set="nothing=1")


def test_perception_without_planner_is_refused():
    with pytest.raises(ValueError, match="perception applies to"):
        HelperEnv("obstacle", perception="learned")


def test_old_names_of_options_warn():
    with pytest.warns(DeprecationWarning, match="progress_per_m"):
        weights = reward_weights({"approached_per_m": 2.0})
    assert weights == chaic.REWARD | {"progress_per_m": 2.0}
    with pytest.warns(DeprecationWarning, match="partner_image_size"):
        HelperEnv("obstacle", observation="proprioception", minds_image_size=32)
    with pytest.warns(DeprecationWarning, match="partner_image_size"):
        HelperVectorEnv("obstacle", observation="proprioception", minds_image_size=32)
    with pytest.raises(TypeError, match="partner_image_size"):
        HelperEnv("obstacle", partner_image_size=32, minds_image_size=32)


def make(n: int = 3, **options) -> HelperVectorEnv:
    env = gymnasium.make_vec(
        ALL,
        num_envs=n,
        vectorization_mode="vector_entry_point",
        **{"image_size": 32, **options},
    )
    return env.unwrapped


def test_a_world_in_a_vector_equals_a_single_world():
    vector = make(copy=True)
    batched, _ = vector.reset(seed=5)
    singles = [gymnasium.make(ALL, image_size=32).unwrapped for _ in range(3)]
    for k, env in enumerate(singles):
        env.np_random = np.random.default_rng(5 + k)
        single, _ = env.reset()
        for part, array in batched.items():
            assert (array[k] == single[part]).all(), part
    rng = np.random.default_rng(0)
    for _ in range(12):
        actions = np.stack([rng.integers(0, [11, 32, 32]) for _ in range(3)])
        batched, rewards, _, _, infos = vector.step(actions)
        for k, env in enumerate(singles):
            single, reward, _, _, info = env.step(actions[k])
            assert (batched["rgb"][k] == single["rgb"]).all()
            assert rewards[k] == pytest.approx(reward)
            assert infos["frames"][k] == info["frames"]
            assert (infos["kind_mask"][k] == info["action_mask"][0]).all()


@pytest.mark.parametrize("mode", ["NextStep", "SameStep", "Disabled"])
def test_episodes_restart_in_each_autoreset_mode(mode):
    vector = make(2, autoreset_mode=mode, observation="proprioception")
    vector.reset(seed=1)
    # Waits reach the horizon in the fewest steps.
    wait = np.tile([chaic.ACTIONS.index("wait"), 0, 0], (2, 1))
    for _ in range(2000):
        observation, _, terminated, truncated, infos = vector.step(wait)
        if (terminated | truncated).any():
            break
    else:
        pytest.fail("no episode ended")
    ended = terminated | truncated
    assert infos["kind_mask"].any(axis=1).all(), "a policy can sample in all worlds"
    if mode == "Disabled":
        with pytest.raises(gymnasium.error.ResetNeeded):
            vector.step(wait)
        vector.reset(options={"reset_mask": ended})
    elif mode == "SameStep":
        assert (infos["final_info"]["frame"][ended] > 1000).all()
        assert infos["_final_obs"].tolist() == ended.tolist()
        assert (infos["frame"][ended] < 100).all()
    else:
        observation, rewards, terminated, truncated, infos = vector.step(wait)
        assert not (terminated | truncated)[ended].any() and (rewards[ended] == 0.0).all()
        assert (infos["frame"][ended] < 100).all() and (infos["frames"][ended] == 0).all()
    observation, *_ = vector.step(wait)
    assert vector.observation_space.contains(observation)


def test_a_vector_writes_into_the_given_arrays():
    out = {"rgb": np.zeros((2, 32, 32, 3), np.uint8), "proprioception": np.zeros((2, 12), np.float32)}
    vector = make(2, observation=("rgb", "proprioception"), out=out)
    observation, _ = vector.reset(seed=0)
    assert np.shares_memory(observation["rgb"], out["rgb"]) and out["rgb"].max() > 0
    with pytest.raises(ValueError, match="expected"):
        make(2, observation="rgb", out={"rgb": np.zeros((2, 32, 32), np.uint8)})
    with pytest.raises(ValueError, match="C-contiguous"):
        make(2, observation="rgb", out={"rgb": np.zeros((2, 32, 32, 6), np.uint8)[..., ::2]})


def test_invalid_vector_arguments_are_refused():
    vector = make(2)
    with pytest.raises(gymnasium.error.ResetNeeded):
        vector.step(np.zeros((2, 3), int))
    vector.reset(seed=0)
    for invalid in (np.zeros((3, 3), int), np.zeros((2, 3)), np.full((2, 3), 99), np.full((2, 3), -1)):
        with pytest.raises(ValueError):
            vector.step(invalid)
    with pytest.raises(ValueError, match="reset_mask is int64"):
        # Indices of worlds are no mask.
        vector.reset(options={"reset_mask": np.array([0, 1])})
    for n in (0, 10_000_000):
        with pytest.raises(ValueError, match="expected 1 to 16384"):
            make(n, observation="proprioception")
    with pytest.raises(ValueError, match="num_envs is at most 1024"):
        make(2000, image_size=1024)
    with pytest.raises(ValueError, match="unknown render mode"):
        HelperVectorEnv("obstacle", render_mode="human")
    first, again = (make(2, observation="proprioception").reset(seed=seed)[1] for seed in (3, np.int64(3)))
    assert first["episode_id"].tolist() == again["episode_id"].tolist()
    with pytest.raises(ValueError, match='add "rgb"'):
        HelperVectorEnv("obstacle", observation="proprioception", render_mode="rgb_array")


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")
@pytest.mark.filterwarnings("ignore:This process .* is multi-threaded")
def test_a_forked_process_can_step_and_reset():
    vector = make(2)
    vector.reset(seed=0)
    wait = np.tile([chaic.ACTIONS.index("wait"), 0, 0], (2, 1))
    vector.step(wait)
    child = os.fork()
    if child == 0:
        vector.step(wait)
        make(2).reset(seed=1)
        try:
            chaic.evaluate({"unknown": object}, quiet=True)
        except RuntimeError as error:
            os._exit(0 if "spawn" in str(error) else 1)
        os._exit(2)
    deadline = time.monotonic() + 60
    while (status := os.waitpid(child, os.WNOHANG)) == (0, 0):
        if time.monotonic() > deadline:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            pytest.fail("the child hangs")
        time.sleep(0.05)
    assert status[1] == 0


def test_environments_run_in_separate_processes():
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


class SmallEnv(HelperEnv):
    """Environment with other arguments than its base class."""

    def __init__(self, image_size: int) -> None:
        super().__init__("obstacle", observation="proprioception", image_size=image_size, reward={"invalid": 3.0})


def test_pickles_and_copies_are_new_environments_with_the_same_arguments():
    def create():
        yield gymnasium.make(IDS["obstacle"], action="plan", image_size=32)
        yield SmallEnv(48)
        yield HelperVectorEnv("obstacle", 2, observation="proprioception")

    for env in create():
        expected, _ = env.reset(seed=4)
        for again in (pickle.loads(pickle.dumps(env)), copy.deepcopy(env)):
            assert type(again.unwrapped) is type(env.unwrapped) and again.spec == env.spec
            assert again.unwrapped.weights == env.unwrapped.weights
            with pytest.raises(gymnasium.error.ResetNeeded):
                again.step(again.action_space.sample())
            observation, _ = again.reset(seed=4)
            for part, array in expected.items():
                assert (observation[part] == array).all(), part


def test_a_vector_returns_new_arrays_unless_it_writes_into_given_ones():
    wait = np.tile([chaic.ACTIONS.index("turn_left"), 0, 0], (2, 1))
    for options, is_kept in [({}, True), ({"copy": False}, False)]:
        vector = make(2, observation="proprioception", **options)
        first, _ = vector.reset(seed=0)
        before = first["proprioception"].copy()
        vector.step(wait)
        assert (first["proprioception"] == before).all() == is_kept
    with pytest.raises(ValueError, match="reset_mask"):
        vector.reset(options={"episode": "obstacle/train/00"})


def test_a_caller_may_change_what_it_gets():
    env = HelperEnv("obstacle", action="plan", image_size=32)
    observation, info = env.reset(seed=0)
    with pytest.raises(ValueError, match="not in"):
        env.step(np.array(0.5))
    ended = False
    while not ended:
        observation.pop("depth")
        # A policy returns an array without dimensions for one observation.
        first = np.array(int(np.flatnonzero(info["action_mask"])[0]))
        observation, _, terminated, truncated, info = env.step(first)
        ended = terminated or truncated
    assert env.observation_space.contains(observation)


def test_actions_refer_to_pixels_without_images_as_well():
    digests = []
    for observation in (("depth", "proprioception"), ("proprioception",)):
        env = gymnasium.make("chaic/LowTarget-v0", observation=observation, image_size=32, disable_env_checker=True)
        env.reset(seed=5)
        rng = np.random.default_rng(5)
        for _ in range(40):
            pick_up = chaic.ACTIONS.index("pick_up_left")
            kind = [0, 0, 1, 2, pick_up, pick_up][rng.integers(6)]
            env.step(np.array([kind, *rng.integers(32, size=2)]))
        digests.append(env.unwrapped.world.digest())
    assert digests[0] == digests[1]


def test_a_reset_takes_an_edited_episode():
    fields = chaic.Episode("low_target/train/03").as_dict()
    del fields["generator"]
    fields["setup"]["horizon"] = 120
    env = HelperEnv("low_target", image_size=32)
    digests = []
    for _ in range(2):
        env.reset(options={"episode": chaic.Episode.from_dict(fields), "seed": 7})
        assert env.world.horizon == 120
        digests.append(env.world.digest())
        env.reset(options={"episode": "low_target/train/03"})
        assert env.world.horizon > 120
    assert digests[0] == digests[1]
