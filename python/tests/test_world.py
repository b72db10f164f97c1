"""Worlds, episodes, planners and built-in helpers in Python."""

import copy
import json
import os
import pickle
import signal
import threading
from pathlib import Path

import numpy as np
import pytest

import chaic

OPTIONS = {"helper": "caller", "image_size": 32}


def play(world: chaic.World, n_actions: int) -> list[str]:
    """Submits a fixed sequence of actions and returns the digest after each."""
    digests = []
    for k in range(n_actions):
        if world.advance() != "needs_action":
            break
        world.submit(["move_forward", "turn_left", [3, 16, 20]][k % 3])
        digests.append(world.digest())
    return digests


def test_equal_seeds_give_equal_digests(episode):
    first, second, other = (chaic.World(episode, seed, **OPTIONS) for seed in (1, 1, 2))
    digests = play(first, 20)
    assert digests == play(second, 20)
    assert first.briefing().seed == second.briefing().seed != other.briefing().seed


def test_an_observation_contains_the_requested_images(episode):
    world = chaic.World(episode, images=["rgb", "depth"], image_size=64)
    assert world.advance() == "needs_action"
    assert world.waiting() == [1]
    observation = world.observe()
    assert observation.rgb.shape == (64, 64, 3) and observation.rgb.dtype == np.uint8 and observation.rgb.max() > 0
    assert observation.depth.shape == (64, 64) and observation.depth.dtype == np.float32
    assert 0.0 < observation.depth.min() and observation.depth.max() <= 100.0
    assert observation.ids is None and observation.granted["classes"] == []
    assert list(observation.proprioception["hands"]) == [None, None]
    values, mask = world.proprioception()
    assert values.shape == (len(chaic.PROPRIOCEPTION),) and mask.shape == (len(chaic.ACTIONS),)
    possible = {name for name, can in zip(chaic.ACTIONS, mask, strict=True) if can}
    assert "pick_up_left" in possible and "put_in" not in possible


def test_goal_and_ids_need_grants(episode):
    world = chaic.World(episode, **OPTIONS)
    briefing = world.briefing()
    assert briefing.goal is None and briefing.disclosure is None and briefing.layout is None
    assert briefing.as_dict()["grants"]["ids"] is False
    with pytest.raises(ValueError, match="grant"):
        chaic.World(episode, images=["ids"])
    granted = chaic.World(episode, images=["ids"], grants=["ids"], image_size=32)
    granted.advance()
    observation = granted.observe()
    assert observation.ids.dtype == np.uint16 and len(observation.granted["classes"]) > 0
    assert "state" not in observation.granted


def test_the_state_needs_its_grant(episode):
    world = chaic.World(episode, grants=["state"], image_size=32)
    world.advance()
    state = world.observe().granted["state"]
    listed = {thing["entity"]: thing for thing in state["objects"]}
    assert len(listed) > 10 and set(state["goal_places"]) <= set(listed)
    assert all(thing["bottom_m"] < thing["top_m"] for thing in listed.values())
    layout = world.briefing().layout
    assert layout["floors"] and {"center_xz", "half_xz", "yaw_rad", "y_range_m"} == set(layout["blocks"][0])


def test_a_restored_snapshot_repeats_the_episode(episode):
    world = chaic.World(episode, **OPTIONS)
    play(world, 5)
    snapshot = world.snapshot()
    digests = play(world, 6)
    world.restore(snapshot)
    assert play(world, 6) == digests
    other = chaic.World(chaic.Episode("obstacle/train/00"), **OPTIONS)
    with pytest.raises(RuntimeError, match="obstacle/train/00"):
        other.restore(snapshot)


def test_render_accepts_an_agent_or_a_camera(episode):
    world = chaic.World(episode, **OPTIONS)
    world.advance()
    partner_view = world.render(agent=0, image_size=48, images=["rgb", "depth", "ids"])
    assert {name: image.shape for name, image in partner_view.items()} == {
        "rgb": (48, 48, 3),
        "depth": (48, 48),
        "ids": (48, 48),
    }
    camera = world.observe().camera | {"width": 40, "height": 30}
    assert world.render(camera=camera)["rgb"].shape == (30, 40, 3)
    assert world.floor_plan(200).shape[1] == 200
    with pytest.raises(ValueError, match="width is 63, expected 64 to 8192"):
        world.floor_plan(63)
    assert world._repr_png_()[:4] == b"\x89PNG"


@pytest.mark.parametrize("yaw", np.linspace(0.1, 6.2, 9))
@pytest.mark.parametrize("up_m", [-1.0, 0.0, 1.5])
def test_a_camera_looks_at_its_target_point(yaw, up_m):
    eye, direction = np.array([1.0, 1.4, -2.0]), np.array([np.sin(yaw), up_m, np.cos(yaw)])
    x, y, z, w = chaic.camera(eye, eye + direction)["world_from_camera"]
    # The camera's axis is -z, and the image is upright.
    axis = [-2 * (x * z + y * w), -2 * (y * z - x * w), -(1 - 2 * (x * x + y * y))]
    assert np.allclose(axis, direction / np.linalg.norm(direction))
    assert abs(2 * (x * y + z * w)) < 1e-9 and 1 - 2 * (x * x + z * z) > 0


def test_an_episode_is_rendered_from_a_given_camera(episode):
    world = chaic.World(episode, grants=["ids"], images=["ids"])
    world.advance()
    position = np.array(world.observe(1).proprioception["pose"]["position"])
    # The camera is above the helper's head, slightly to the side.
    camera = chaic.camera(position + [0.3, 1.0, 0.0], position, width=65, height=65)
    ids = chaic.render(episode, camera=camera, images=["ids"])["ids"]
    assert ids[32, 32] in np.unique(world.render(camera=camera, images=["ids"])["ids"])
    assert chaic.render(world, camera=camera)["rgb"].shape == (65, 65, 3)
    for eye, look_at in [([0, 2, 0], [0, 0, 0]), ([0, 2, 0], [1]), ([0, 2], [1, 2])]:
        with pytest.raises(ValueError, match="differ in x or z"):
            chaic.camera(eye, look_at)
    for fov_deg in (0, 180, float("nan")):
        with pytest.raises(ValueError, match="no view"):
            world.render(camera=chaic.camera([0, 2, 0], [1, 2, 0], vertical_fov_deg=fov_deg))


def test_show_opens_the_top_view_in_the_browser(episode, monkeypatch):
    opened = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    episode.show()
    chaic.World(episode).show()
    assert all("data:image/png" in Path(url.removeprefix("file://")).read_text() for url in opened)
    assert len(opened) == 2


def test_objects_with_a_state_are_neither_pickled_nor_copied(episode):
    world, batch = chaic.World(episode, **OPTIONS), chaic.Batch([episode], [0], **OPTIONS)
    for item in (world, batch, chaic.Planner(), chaic.PlanningAgent("rhp")):
        for function in (pickle.dumps, copy.copy, copy.deepcopy):
            with pytest.raises(TypeError, match=f"a {type(item).__name__} can be neither pickled nor copied: "):
                function(item)


def test_a_changed_episode_is_parsed_and_checked(episode):
    assert chaic.Episode.from_json(episode.to_json()).to_json() == episode.to_json()
    assert pickle.loads(pickle.dumps(episode)).to_json() == episode.to_json()
    fields = episode.as_dict()
    assert fields == json.loads(episode.to_json())
    del fields["generator"]
    fields["id"] = "mine"
    fields["setup"]["horizon"] = 100
    mine = chaic.Episode.from_dict(fields)
    assert mine.id == "mine" and chaic.World(mine, **OPTIONS).horizon == 100
    fields["setup"]["horizon"] = -1
    with pytest.raises(ValueError, match="horizon"):
        chaic.Episode.from_dict(fields)
    assert chaic.Episode("obstacle/gen/7").task == "obstacle"
    assert len(chaic.episode_ids("train", "obstacle")) == 12


@pytest.mark.parametrize(
    ("kind", "call"),
    [
        (ValueError, lambda e: chaic.Episode("nowhere/train/00")),
        (ValueError, lambda e: chaic.episode_ids("tarin", "obstacle")),
        (TypeError, lambda e: chaic.World(e, helpre="rhp")),
        (TypeError, lambda e: chaic.World(e, image_size="large")),
        (ValueError, lambda e: chaic.World(e, image_size=5)),
        (ValueError, lambda e: chaic.World(e, helper="nobody")),
        (ValueError, lambda e: chaic.World(e, partner="nobody")),
        (ValueError, lambda e: chaic.World(e, helper="rhp", perception="crystal ball")),
        (ValueError, lambda e: chaic.World(e, helper="smart_help", behavior="learned")),
        (ValueError, lambda e: chaic.PlanningAgent("rhp", behavior="crystal ball")),
        (RuntimeError, lambda e: chaic.Planner(perception="learned:missing.safetensors")),
        (ValueError, lambda e: chaic.World(e, grants=["gold"])),
        (ValueError, lambda e: chaic.World(e, set=["nothing=1"])),
        (RuntimeError, lambda e: chaic.World(e).observe()),
        (RuntimeError, lambda e: chaic.World(e).submit("turn_left")),
        (ValueError, lambda e: waiting(e).submit("fly")),
        (ValueError, lambda e: waiting(e).submit([99, 0, 0])),
        (ValueError, lambda e: waiting(e).submit([3, -1, 0])),
        (ValueError, lambda e: waiting(e).submit({"wait": {"frames": 0}})),
        (ValueError, lambda e: waiting(e).submit(None)),
        (ValueError, lambda e: waiting(e).submit(np.full(3, np.nan))),
        (ValueError, lambda e: waiting(e).submit("turn_left", agent=7)),
    ],
)
def test_invalid_arguments_raise_a_one_line_error(episode, kind, call):
    with pytest.raises(kind) as raised:
        call(episode)
    assert "\n" not in str(raised.value) and str(raised.value)


def waiting(episode: chaic.Episode) -> chaic.World:
    world = chaic.World(episode, **OPTIONS)
    world.advance()
    return world


def test_a_world_in_use_by_another_thread_raises(episode):
    world = chaic.World(episode, image_size=64)
    errors: list[BaseException] = []

    def work() -> None:
        try:
            for _ in range(40):
                if world.advance() == "needs_action":
                    world.observe()
                    world.submit("turn_left")
        except RuntimeError as error:
            errors.append(error)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for error in errors:
        assert "borrowed" in str(error) or "needs no action now" in str(error)
    assert world.frame > 0


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no signals of this kind")
def test_ctrl_c_stops_a_long_call_and_the_next_call_continues(episode, request):
    # Programs that shells start in the background ignore this signal.
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)
    request.addfinalizer(lambda: signal.signal(signal.SIGINT, handler))
    stopped, whole = (chaic.World(episode, helper="rhp") for _ in range(2))
    threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        stopped.advance()
    assert stopped.frame < stopped.horizon
    until = stopped.frame + 30
    assert stopped.advance(until) == whole.advance(until) == "stopped"
    assert stopped.digest() == whole.digest()


def test_a_built_in_helper_acts_alike_inside_and_outside_the_world(episode):
    agent = chaic.PlanningAgent("rhp")
    inside = chaic.World(episode, helper="rhp")
    outside = chaic.World(
        episode, grants=agent.grants, images=["depth", "ids"], image_size=512
    )
    agent.reset(outside.briefing())
    while outside.advance(900) == "needs_action":
        outside.submit(agent.act(outside.observe()))
    inside.advance(900)
    assert outside.digest() == inside.digest()


def test_a_planner_executes_the_chosen_plans(episode):
    planner = chaic.Planner(image_size=128)
    world = chaic.World(episode, grants=planner.grants, images=planner.images, image_size=128)
    planner.reset(world.briefing())
    n_chosen = 0
    while world.advance() == "needs_action" and world.frame < 1500:
        action = planner.act(world.observe())
        while action is None:
            plans = planner.plans()
            vectors = planner.plan_features()
            assert vectors.shape == (len(plans), len(chaic.PLAN_FEATURES))
            assert (vectors[:, :11].sum(axis=1) == 1).all()
            with pytest.raises(IndexError):
                planner.choose(len(plans))
            wanted = [k for k, plan in enumerate(plans) if plan.startswith(("bring", "go to"))]
            action = planner.choose(wanted[0] if wanted else n_chosen % len(plans))
            n_chosen += 1
        world.submit(action)
    assert n_chosen > 2
    assert len(planner.remembered_objects()) > 5
    assert planner.semantic_map(32)[0].sum() > 100, "the map contains observed cells"


def test_agents_without_a_briefing_say_so(episode):
    observation = waiting(episode).observe()
    for agent in (chaic.PlanningAgent("random"), chaic.Planner()):
        with pytest.raises(RuntimeError, match="call reset"):
            agent.act(observation)


def test_behavior_from_images_needs_a_helper_inside_a_world():
    for create in (lambda: chaic.PlanningAgent("rhp", behavior="learned"), lambda: chaic.Planner(behavior="learned")):
        with pytest.raises(ValueError, match="images between decisions"):
            create()


def test_a_planner_follows_the_rules_of_its_world(episode):
    inside = chaic.World(episode, helper="rhp", rules="compat")
    agent = chaic.PlanningAgent("rhp", rules="compat")
    outside = chaic.World(episode, grants=agent.grants, images=["depth", "ids"], image_size=512, rules="compat")
    agent.reset(outside.briefing())
    while outside.advance(600) == "needs_action":
        outside.submit(agent.act(outside.observe()))
    inside.advance(600)
    assert outside.digest() == inside.digest()
    with pytest.raises(ValueError, match="papr"):
        chaic.Planner(rules="papr")


def test_batch_arrays_have_the_shape_of_the_images(episode):
    batch = chaic.Batch([episode], [0], images=["depth"], image_size=16)
    batch.advance()
    depth = np.zeros((1, 16, 16), np.float32)
    batch.observe(depth=depth)
    wrong = [
        {"depth": depth.reshape(16, 16, 1)},
        {"depth": np.zeros((1, 8, 32), np.float32)},
        {"depth": depth, "rgb": np.zeros(0, np.uint8)},
        {},
    ]
    for arrays in wrong:
        with pytest.raises(ValueError):
            batch.observe(**arrays)
    fortran = np.zeros((1, 16, 16), np.float32, order="F")
    for call in (batch.observe, batch.advance_and_observe):
        with pytest.raises(ValueError, match="C-contiguous"):
            call(depth=fortran)
        with pytest.raises(ValueError, match="C-contiguous"):
            call(depth=depth.transpose(0, 2, 1))
    assert not fortran.any() and depth.any()


def test_read_only_arrays_and_shared_memory_raise_errors(episode):
    batch = chaic.Batch([episode], [0], images=["rgb", "depth"], image_size=16)
    batch.advance()
    memory = np.zeros(4 * 16 * 16, np.float32)
    depth, rgb = memory.reshape(4, 16, 16)[:1], memory.view(np.uint8)[: 3 * 16 * 16].reshape(1, 16, 16, 3)
    with pytest.raises(RuntimeError, match="memory of the array"):
        batch.observe(rgb=rgb, depth=depth)
    rgb = rgb.copy()
    rgb.flags.writeable = False
    with pytest.raises(ValueError, match="rgb is read-only"):
        batch.advance_and_observe(rgb=rgb, depth=depth)
    values, mask = np.zeros((1, 12), np.float32), np.zeros((1, 11), bool)
    mask.flags.writeable = False
    with pytest.raises(ValueError, match="mask is read-only"):
        batch.proprioception(values, mask)


def test_a_view_is_that_of_the_helper_or_of_a_camera(episode):
    world = waiting(episode)
    assert (world.render()["rgb"] == world.render(1)["rgb"]).all()
    assert (world.render()["rgb"] != world.render(0)["rgb"]).any()
    camera = world.observe().camera
    with pytest.raises(ValueError, match="agent or a camera"):
        world.render(0, camera=camera)
    with pytest.raises(ValueError, match="own width and height"):
        world.render(camera=camera, image_size=64)
    with pytest.raises(ValueError, match="agent is -1"):
        world.render(-1)
    assert list(world.render(images="depth")) == ["depth"]
    alone = chaic.World(episode, helper="none")
    assert (alone.render()["rgb"] == alone.render(0)["rgb"]).all()
    assert alone.render(camera=camera)["rgb"].any()


def test_the_detector_finds_objects_in_an_image(episode):
    world = chaic.World(episode, image_size=256)
    world.advance()
    detections = chaic.Detector().detect(world.observe())
    assert detections and all(0.0 <= detection["score"] <= 1.0 for detection in detections)
    assert all(d["mask"].shape == (256, 256) and d["mask"].any() for d in detections)
    with pytest.raises(ValueError):
        chaic.Detector(b"no weights")


def test_old_names_warn_or_name_the_new_one(episode):
    with pytest.warns(DeprecationWarning, match="partner_image_size"):
        chaic.World(episode, minds_image_size=32, **OPTIONS)
    with pytest.warns(DeprecationWarning, match="chaic.PROPRIOCEPTION"):
        assert chaic.OWN == chaic.PROPRIOCEPTION
    with pytest.warns(DeprecationWarning, match="chaic.PlanningAgent"):
        assert chaic.Mind is chaic.PlanningAgent
    world = waiting(episode)
    for instance, old, new in [
        (world.observe(), "own", "proprioception"),
        (world, "own", "proprioception"),
        (world, "plan", "floor_plan"),
        (episode, "plan", "floor_plan"),
        (chaic.Batch([episode], [0], **OPTIONS), "own", "proprioception"),
        (chaic.Planner(), "attend", "act"),
        (chaic.Planner(), "things", "remembered_objects"),
        (world.observe(), "film", "frame_history"),
        (world.briefing(), "told", "disclosure"),
        (chaic.PlanningAgent("rhp"), "senses", "sensors"),
    ]:
        with pytest.raises(AttributeError, match=new):
            getattr(instance, old)


def test_numbers_out_of_range_raise_value_errors(episode, tmp_path):
    with pytest.raises(ValueError, match="seed is -1, expected 0 to 4294967295"):
        chaic.World(episode, -1)
    with pytest.raises(ValueError, match="seed is 4294967296"):
        chaic.World(episode).reset(seed=2**32)
    with pytest.raises(ValueError, match=r"seeds is \[-1\]"):
        chaic.Batch([episode], [-1])
    with pytest.raises(ValueError, match="agent is -1"):
        chaic.World(episode).briefing(-1)
    world, batch, planner = waiting(episode), chaic.Batch([episode], [0], **OPTIONS), chaic.Planner()
    for name, call in [
        ("until", lambda: world.advance(-1)),
        ("width", lambda: world.floor_plan(-1)),
        ("width", lambda: episode.floor_plan(-1)),
        ("image_size", lambda: world.render(image_size=-1)),
        ("height", lambda: world.render(camera=world.observe().camera | {"height": -1})),
        ("image_size", lambda: chaic.World(episode, image_size=-1)),
        ("partner_image_size", lambda: chaic.World(episode, partner_image_size=-1)),
        ("world", lambda: batch.score(-1)),
        ("world", lambda: batch.digest(-1)),
        ("world", lambda: batch.briefing(-1)),
        ("image_size", lambda: chaic.Planner(image_size=-1)),
        ("side", lambda: planner.semantic_map(-1)),
        ("index", lambda: planner.choose(-1)),
    ]:
        with pytest.raises(ValueError, match=f"^{name} is -1, expected"):
            call()
    with pytest.raises(ValueError, match=r"worlds is \[-1\]"):
        batch.reset([-1], [episode], [0])
    with pytest.raises(ValueError, match="a number in it is negative or too large"):
        world.submit({"wait": {"frames": -1}})
    with pytest.raises(ValueError, match="n_episodes is -1"):
        chaic.evaluate(baselines="none", out=tmp_path / "run", n_episodes=-1, quiet=True)
    with pytest.raises(ValueError, match="no pixels"):
        chaic.encode_png(np.zeros((0, 4, 3), np.uint8))
    with pytest.raises(ValueError, match="expected at most 10000000"):
        chaic.episode_ids("gen:0..1000000000", "obstacle")
    with pytest.raises(ValueError, match="jobs is -1"):
        chaic.evaluate(baselines="none", out=tmp_path / "run", jobs=-1, quiet=True)


def test_one_grant_may_be_a_string(episode):
    world = chaic.World(episode, grants="ids", images="ids", image_size=32)
    assert world.briefing().grants["ids"]
    with pytest.raises(ValueError, match='unknown grant "idz"'):
        chaic.World(episode, grants="idz")


def test_one_setting_may_be_a_string(episode):
    for create in (
        lambda setting: chaic.World(episode, set=setting),
        lambda setting: chaic.Batch([episode], [0], set=setting),
        lambda setting: chaic.PlanningAgent("rhp", set=setting),
        lambda setting: chaic.Planner(set=setting),
    ):
        create("world.stride_m=0.3")
        with pytest.raises(ValueError, match="no rule `nothing`"):
            create("nothing=1")
