"""Worlds, episodes and minds from Python."""

import json
import pickle
import threading
from pathlib import Path

import numpy as np
import pytest

import chaic

GIVEN = {"helper": "caller", "image_size": 32}


def play(world: chaic.World, decisions: int) -> list[str]:
    """Walks about by fixed actions; the digests on the way."""
    digests = []
    for k in range(decisions):
        if world.advance() != "waits":
            break
        world.submit(["move_forward", "turn_left", [3, 16, 20]][k % 3])
        digests.append(world.digest())
    return digests


def test_the_same_seed_gives_the_same_bits(episode):
    first, again, other = (chaic.World(episode, seed, **GIVEN) for seed in (1, 1, 2))
    digests = play(first, 20)
    assert digests == play(again, 20)
    assert first.briefing().seed == again.briefing().seed != other.briefing().seed


def test_an_observation_is_what_was_asked_for(episode):
    world = chaic.World(episode, images=["rgb", "depth"], image_size=64)
    assert world.advance() == "waits"
    assert world.waiting() == [1]
    seen = world.observe()
    assert seen.rgb.shape == (64, 64, 3) and seen.rgb.dtype == np.uint8 and seen.rgb.max() > 0
    assert seen.depth.shape == (64, 64) and seen.depth.dtype == np.float32
    assert 0.0 < seen.depth.min() and seen.depth.max() <= 100.0
    assert seen.ids is None and seen.granted["classes"] == []
    assert list(seen.own["hands"]) == [None, None]
    numbers, mask = world.own()
    assert numbers.shape == (len(chaic.OWN),) and mask.shape == (len(chaic.ACTIONS),)
    possible = {name for name, can in zip(chaic.ACTIONS, mask, strict=True) if can}
    assert "pick_up_left" in possible and "put_in" not in possible


def test_what_is_hidden_stays_hidden(episode):
    world = chaic.World(episode, **GIVEN)
    briefing = world.briefing()
    assert briefing.goal is None and briefing.told is None
    assert briefing.as_dict()["grants"]["ids"] is False
    with pytest.raises(ValueError, match="grant"):
        chaic.World(episode, images=["ids"])
    granted = chaic.World(episode, images=["ids"], grants=["ids"], image_size=32)
    granted.advance()
    seen = granted.observe()
    assert seen.ids.dtype == np.uint16 and len(seen.granted["classes"]) > 0


def test_snapshots_go_on_as_the_world_did(episode):
    world = chaic.World(episode, **GIVEN)
    play(world, 5)
    snapshot = world.snapshot()
    went_on = play(world, 6)
    world.restore(snapshot)
    assert play(world, 6) == went_on
    other = chaic.World(chaic.Episode("obstacle/train/00"), **GIVEN)
    with pytest.raises(RuntimeError, match="obstacle/train/00"):
        other.restore(snapshot)


def test_onlookers_see_from_any_camera(episode):
    world = chaic.World(episode, **GIVEN)
    world.advance()
    of_partner = world.render(agent=0, image_size=48, images=["rgb", "depth", "ids"])
    assert {name: image.shape for name, image in of_partner.items()} == {
        "rgb": (48, 48, 3),
        "depth": (48, 48),
        "ids": (48, 48),
    }
    camera = world.observe().camera | {"width": 40, "height": 30}
    assert world.render(camera=camera)["rgb"].shape == (30, 40, 3)
    assert world.plan(200).shape[1] == 200
    assert world._repr_png_()[:4] == b"\x89PNG"


@pytest.mark.parametrize("yaw", np.linspace(0.1, 6.2, 9))
@pytest.mark.parametrize("up_m", [-1.0, 0.0, 1.5])
def test_a_camera_looks_at_the_point_it_is_told_to(yaw, up_m):
    eye, away = np.array([1.0, 1.4, -2.0]), np.array([np.sin(yaw), up_m, np.cos(yaw)])
    x, y, z, w = chaic.camera(eye, eye + away)["world_from_camera"]
    # The camera's axis is -z, and its image stands upright.
    axis = [-2 * (x * z + y * w), -2 * (y * z - x * w), -(1 - 2 * (x * x + y * y))]
    assert np.allclose(axis, away / np.linalg.norm(away))
    assert abs(2 * (x * y + z * w)) < 1e-9 and 1 - 2 * (x * x + z * z) > 0


def test_episodes_are_drawn_from_cameras_of_ones_own(episode):
    world = chaic.World(episode, grants=["ids"], images=["ids"])
    world.advance()
    there = np.array(world.observe(1).own["pose"]["position"])
    # From above the helper's head, a little aside.
    camera = chaic.camera(there + [0.3, 1.0, 0.0], there, width=65, height=65)
    ids = chaic.render(episode, camera=camera, images=["ids"])["ids"]
    assert ids[32, 32] in np.unique(world.render(camera=camera, images=["ids"])["ids"])
    assert chaic.render(world, camera=camera)["rgb"].shape == (65, 65, 3)
    with pytest.raises(ValueError, match="none above the other"):
        chaic.camera([0, 2, 0], [0, 0, 0])


def test_places_are_shown_in_the_browser(episode, monkeypatch):
    opened = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    episode.show()
    chaic.World(episode).show()
    assert all("data:image/png" in Path(url.removeprefix("file://")).read_text() for url in opened)
    assert len(opened) == 2


def test_episodes_are_read_changed_and_checked(episode):
    assert chaic.Episode.from_json(episode.to_json()).to_json() == episode.to_json()
    assert pickle.loads(pickle.dumps(episode)).to_json() == episode.to_json()
    fields = episode.as_dict()
    assert fields == json.loads(episode.to_json())
    del fields["generator"]
    fields["id"] = "mine"
    fields["setup"]["horizon"] = 100
    mine = chaic.Episode.from_dict(fields)
    assert mine.id == "mine" and chaic.World(mine, **GIVEN).horizon == 100
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
        (ValueError, lambda e: chaic.Mind("rhp", behavior="crystal ball")),
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
def test_mistakes_are_told_in_one_sentence(episode, kind, call):
    with pytest.raises(kind) as told:
        call(episode)
    assert "\n" not in str(told.value) and str(told.value)


def waiting(episode: chaic.Episode) -> chaic.World:
    world = chaic.World(episode, **GIVEN)
    world.advance()
    return world


def test_a_world_that_another_thread_works_with_says_so(episode):
    world = chaic.World(episode, image_size=64)
    told: list[BaseException] = []

    def work() -> None:
        try:
            for _ in range(40):
                if world.advance() == "waits":
                    world.observe()
                    world.submit("turn_left")
        except RuntimeError as error:
            told.append(error)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for error in told:
        assert "borrowed" in str(error) or "isn't asked" in str(error)
    assert world.frame > 0


def test_a_built_in_mind_from_python_plays_as_it_does_within(episode):
    mind = chaic.Mind("rhp")
    within = chaic.World(episode, helper="rhp")
    outside = chaic.World(
        episode, grants=mind.grants, images=["depth", "ids"], image_size=512
    )
    mind.reset(outside.briefing())
    while outside.advance(900) == "waits":
        outside.submit(mind.act(outside.observe()))
    within.advance(900)
    assert outside.digest() == within.digest()


def test_a_planner_follows_the_plans_that_are_chosen(episode):
    planner = chaic.Planner(image_size=128)
    world = chaic.World(episode, grants=planner.grants, images=planner.images, image_size=128)
    planner.reset(world.briefing())
    chosen = 0
    while world.advance() == "waits" and world.frame < 1500:
        action = planner.attend(world.observe())
        while action is None:
            plans = planner.plans()
            numbers = planner.plan_numbers()
            assert numbers.shape == (len(plans), len(chaic.PLAN))
            assert (numbers[:, :11].sum(axis=1) == 1).all()
            with pytest.raises(IndexError):
                planner.choose(len(plans))
            wanted = [k for k, plan in enumerate(plans) if plan.startswith(("bring", "go to"))]
            action = planner.choose(wanted[0] if wanted else chosen % len(plans))
            chosen += 1
        world.submit(action)
    assert chosen > 2
    assert len(planner.things()) > 5
    assert planner.semantic_map(32)[0].sum() > 100, "something of the place is known"


def test_the_detector_finds_what_is_in_an_image(episode):
    world = chaic.World(episode, image_size=256)
    world.advance()
    found = chaic.Detector().detect(world.observe())
    assert found and all(0.0 <= one["score"] <= 1.0 for one in found)
    assert all(one["mask"].shape == (256, 256) and one["mask"].any() for one in found)
    with pytest.raises(ValueError):
        chaic.Detector(b"no weights")
