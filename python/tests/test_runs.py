"""Benchmark runs with Python helpers."""

import html
import json
import re
import sys
import time
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

import chaic
import chaic.ray
from chaic.watchdog import Watchdog, _TimeLimitExceeded

OPTIONS = {"tasks": "low_target", "split": "train", "n_episodes": 1, "jobs": 2, "quiet": True}


class Turner:
    """Turns and waits; never helps."""

    images = ("depth",)
    image_size = 64

    def reset(self, briefing: chaic.Briefing) -> None:
        assert briefing.goal is None
        self.n = 0

    def act(self, observation: chaic.Observation):
        self.n += 1
        assert observation.depth.shape == (64, 64)
        return "turn_left" if self.n % 2 else {"wait": {"frames": 30}}


class Rhp:
    """Calls the built-in helper from Python."""

    def __init__(self) -> None:
        self.agent = chaic.PlanningAgent("rhp")

    grants = tuple(chaic.PlanningAgent("rhp").grants)
    images = ("depth", "ids")

    def reset(self, briefing: chaic.Briefing) -> None:
        self.agent.reset(briefing)

    def act(self, observation: chaic.Observation):
        return self.agent.act(observation)


def write_short_episode(episode, folder, horizon):
    """Writes an episode with another time limit to a new folder, and returns the folder."""
    fields = episode.as_dict()
    del fields["generator"]
    fields["setup"]["horizon"] = horizon
    folder.mkdir()
    (folder / "short.json").write_text(chaic.Episode.from_dict(fields).to_json())
    return folder


def test_a_python_helper_is_scored_and_verified(tmp_path):
    run = chaic.evaluate(Turner, baselines=["none"], out=tmp_path / "run", **OPTIONS)
    records = run.records()
    assert records["helper"].tolist() == ["none", "turner"]
    assert not records["failed"].any() and (records["wanted"] > 0).all()
    assert run.options["helpers"] == ["none", "turner"]
    assert "turner" in run.report()
    for name in ["report.md", "report.html"]:
        assert "turner" in (tmp_path / "run" / name).read_text().lower()
    run.verify()
    page = run.view(helper="turner")
    assert page.path.read_text().count('class="chaic-replay"') == 1
    assert "srcdoc=" in page._repr_html_()
    with pytest.raises(RuntimeError, match="obstacle/test/00"):
        run.view("obstacle/test/00")
    with pytest.raises(RuntimeError):
        chaic.evaluate(Turner, out=tmp_path / "run", **OPTIONS)


def test_a_partial_has_the_attributes_of_its_class(tmp_path):
    run = chaic.evaluate(partial(Turner), out=tmp_path / "run", baselines="none", **OPTIONS)
    assert run.options["helpers"] == ["none", "turner"]
    assert not run.records()["failed"].any()


def test_a_built_in_helper_acts_alike_from_python_and_rust(tmp_path):
    run = chaic.evaluate({"mine": Rhp}, baselines=["rhp"], out=tmp_path / "run", **OPTIONS)
    mine, rhp = run.results()
    assert (mine["helper"], rhp["helper"]) == ("mine", "rhp")
    assert mine["digest"] == rhp["digest"] and mine["deliveries"] == rhp["deliveries"]


def test_a_helper_that_raises_scores_zero_and_the_run_continues(tmp_path):
    class FailsLater(Turner):
        def act(self, observation):
            if observation.frame > 200:
                raise KeyError("test error")
            return super().act(observation)

    class InvalidAction(Turner):
        def act(self, observation):
            return {"fly": "away"}

    class FailsInInit(Turner):
        def __init__(self):
            raise OSError("no such weights")

    makers = {"fails_later": FailsLater, "invalid_action": InvalidAction, "fails_in_init": FailsInInit, "fine": Turner}
    chaic.evaluate(makers, out=tmp_path / "run", **OPTIONS)
    results = {r["helper"]: r for r in chaic.Run(tmp_path / "run").results()}
    assert "test error" in results["fails_later"]["message"]
    assert "test_runs.py" in results["fails_later"]["message"], "the message contains the traceback"
    assert "no action" in results["invalid_action"]["message"]
    assert "no such weights" in results["fails_in_init"]["message"]
    assert "done" in results["fine"]
    assert chaic.Run(tmp_path / "run").records()["failed"].sum() == 3


def test_a_helper_that_hangs_scores_zero_and_the_run_continues(tmp_path):
    class HangsInAct(Turner):
        def act(self, observation):
            while True:
                pass

    class HangsInReset(Turner):
        def reset(self, briefing):
            while True:
                time.sleep(0.01)

    class Retries(Turner):
        def act(self, observation):
            for _ in range(2):
                try:
                    while True:
                        pass
                except BaseException:
                    continue
            return "turn_left"

    makers = {"hangs_in_act": HangsInAct, "hangs_in_reset": HangsInReset, "retries": Retries, "fine": Turner}
    run = chaic.evaluate(makers, out=tmp_path / "run", limit_s=1.0, **OPTIONS)
    results = {r["helper"]: r for r in run.results()}
    assert "act took longer than 1 s" in results["hangs_in_act"]["message"]
    assert "reset took longer than 1 s" in results["hangs_in_reset"]["message"]
    assert "act took longer than 1 s" in results["retries"]["message"]
    assert "test_runs.py" in results["hangs_in_act"]["message"], "the message contains the traceback"
    assert "done" in results["fine"]
    with pytest.raises(ValueError):
        chaic.evaluate(Turner, out=tmp_path / "other", limit_s=0.0, **OPTIONS)


def test_an_exception_at_the_end_of_a_call_is_a_time_limit():
    class Late(Watchdog):
        n_ends = 0

        def _end(self, thread):
            is_expired = super()._end(thread)
            self.n_ends += 1
            if self.n_ends == 1:
                raise _TimeLimitExceeded
            return is_expired

    with pytest.raises(TimeoutError, match="act took longer"):
        Late(1.0).call("act", lambda: "turn_left")


def test_numbers_of_a_run_on_ray_are_checked(tmp_path):
    for number in ("shards", "jobs", "tries"):
        with pytest.raises(ValueError, match=f"{number} is 0, expected at least 1"):
            chaic.ray.evaluate(Turner, out=tmp_path / "run", **{number: 0})


class LocalRay:
    """Runs the tasks of Ray in this process."""

    exceptions = SimpleNamespace(RayError=RuntimeError)

    def is_initialized(self):
        return True

    def remote(self, **_):
        return lambda function: SimpleNamespace(remote=lambda *arguments: partial(function, *arguments))

    def wait(self, references, num_returns):
        return references[:num_returns], references[num_returns:]

    def get(self, reference):
        return reference()

    def cancel(self, reference, force):
        pass


def test_shards_stay_after_a_failure_and_go_after_the_merge(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", LocalRay())
    play = chaic.ray._play

    def lose_second(helper, shard, jobs, options):
        if shard == "2/2":
            raise OSError("the worker is lost")
        return play(helper, shard, jobs, options)

    options = {"baselines": "none", "tasks": "low_target", "split": "train", "n_episodes": 2, "shards": 2, "tries": 1}
    shards = tmp_path / "run.shards"
    with monkeypatch.context() as patched:
        patched.setattr(chaic.ray, "_play", lose_second)
        with pytest.raises(RuntimeError, match=r"shard 2 of 2 failed 1 times; .*run\.shards keeps the finished shards"):
            chaic.ray.evaluate(out=tmp_path / "run", **options)
    assert [folder.name for folder in shards.iterdir()] == ["1-of-2"]
    run = chaic.ray.evaluate(out=tmp_path / "run", **options)
    assert len(run.results()) == 2 and not shards.exists()
    with pytest.raises(ValueError):
        chaic.ray.evaluate(out=tmp_path / "other", rules="papr", **options)
    assert not (tmp_path / "other.shards").exists(), "no shard was played"


def test_ctrl_c_cancels_the_tasks_of_a_cluster(tmp_path, monkeypatch):
    cancelled = []

    class Interrupted(LocalRay):
        def wait(self, references, num_returns):
            raise KeyboardInterrupt

        def cancel(self, reference, force):
            cancelled.append(reference)

    monkeypatch.setitem(sys.modules, "ray", Interrupted())
    with pytest.raises(KeyboardInterrupt):
        chaic.ray.evaluate(out=tmp_path / "run", baselines="none", shards=2)
    assert len(cancelled) == 2 and not (tmp_path / "run.shards").exists()


def test_an_interrupted_run_can_be_resumed(tmp_path):
    class Interrupts(Turner):
        def act(self, observation):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        chaic.evaluate({"turner": Interrupts}, out=tmp_path / "run", **OPTIONS)
    run = chaic.evaluate(Turner, out=tmp_path / "run", resume=True, **OPTIONS)
    assert len(run.results()) == 1


def test_a_resumed_run_has_the_options_of_its_start(tmp_path):
    class Interrupts(Turner):
        def act(self, observation):
            raise KeyboardInterrupt

    start = {"out": tmp_path / "run", "quiet": True}
    with pytest.raises(KeyboardInterrupt):
        chaic.evaluate({"turner": Interrupts}, tasks="low_target", split="train", n_episodes=1, **start)
    with pytest.raises(ValueError, match="--split"):
        chaic.evaluate(Turner, split="test", resume=True, **start)
    run = chaic.evaluate(Turner, resume=True, **start)
    assert run.options["split"] == "train" and len(run.results()) == 1


def test_a_resumed_run_has_the_time_limit_of_its_start(tmp_path):
    class Interrupts(Turner):
        def act(self, observation):
            raise KeyboardInterrupt

    start = {"out": tmp_path / "run", **OPTIONS}
    with pytest.raises(KeyboardInterrupt):
        chaic.evaluate({"turner": Interrupts}, limit_s=30.5, **start)
    with pytest.raises(ValueError, match=r"limit_s of turner is 5 now, but .*run\.json has 30\.5"):
        chaic.evaluate(Turner, limit_s=5, resume=True, **start)
    run = chaic.evaluate(Turner, resume=True, **start)
    assert len(run.results()) == 1


def test_a_resumed_run_has_the_images_of_its_start(tmp_path):
    class Interrupts(Turner):
        def act(self, observation):
            raise KeyboardInterrupt

    start = {"out": tmp_path / "run", **OPTIONS}
    with pytest.raises(KeyboardInterrupt):
        chaic.evaluate({"turner": Interrupts}, **start)
    for change in [{"image_size": 32}, {"images": ("rgb", "depth")}, {"images": ()}]:
        other = type("Other", (Turner,), change)
        with pytest.raises(ValueError, match="turner requests .* now, but .*run.json has depth of 64 pixels"):
            chaic.evaluate({"turner": other}, resume=True, **start)
    run = chaic.evaluate(Turner, resume=True, **start)
    assert len(run.results()) == 1


def test_a_resumed_run_has_the_perception_of_its_start(tmp_path, episode):
    folder = write_short_episode(episode, tmp_path / "episodes", horizon=60)
    start = {"baselines": "rhp", "out": tmp_path / "run", "quiet": True}
    chaic.evaluate(episodes=folder, perception="learned", **start)
    run = chaic.evaluate(resume=True, **start)
    assert run.options["perception"] == "learned" and not run.records()["failed"].any()
    for option, name in [("perception", "gt"), ("behavior", "learned")]:
        with pytest.raises(ValueError, match=f"--{option}"):
            chaic.evaluate(resume=True, **{option: name}, **start)


def test_invalid_arguments_are_refused(tmp_path):
    out = tmp_path / "run"
    for kind, call in [
        (ValueError, lambda: chaic.evaluate(out=out, **OPTIONS)),
        (TypeError, lambda: chaic.evaluate({"mine": 3}, out=out, **OPTIONS)),
        (ValueError, lambda: chaic.evaluate({"rhp": Turner}, out=out, **OPTIONS)),
        (ValueError, lambda: chaic.evaluate({"a/b": Turner}, out=out, **OPTIONS)),
        (ValueError, lambda: chaic.evaluate({"a": Turner, "b": Rhp}, out=out, **OPTIONS)),
        (ValueError, lambda: chaic.evaluate(Turner, out=out, **{**OPTIONS, "tasks": "flying"})),
        (ValueError, lambda: chaic.evaluate(Turner, out=out, track="open", **OPTIONS)),
        (ValueError, lambda: chaic.evaluate(baselines="smart_help", behavior="learned", out=out, **OPTIONS)),
        (ValueError, lambda: chaic.evaluate(Turner, out=out, rules="papr", **OPTIONS)),
        (ValueError, lambda: chaic.evaluate(Turner, out=out, set="nothing=1", **OPTIONS)),
        (ValueError, lambda: chaic.evaluate(Turner, out=out, episodes=tmp_path, **OPTIONS)),
        (ValueError, lambda: chaic.evaluate(Turner, out=out, **{**OPTIONS, "jobs": 0})),
        (ValueError, lambda: chaic.evaluate(Turner, out=out, **{**OPTIONS, "n_episodes": -1})),
        (ValueError, lambda: chaic.evaluate(Turner, out=out, seeds=-1, **OPTIONS)),
        (ValueError, lambda: chaic.evaluate(Turner, out=out, baselines=["rpp"], **OPTIONS)),
        (TypeError, lambda: chaic.evaluate(Turner, out=out, colour="red", **OPTIONS)),
        (FileNotFoundError, lambda: chaic.Run(tmp_path / "nothing")),
    ]:
        with pytest.raises(kind):
            call()
    assert not out.exists()


def test_the_hidden_track_refuses_grants_and_is_recorded(tmp_path):
    with pytest.raises(ValueError, match="`mine` is granted ids, which the hidden track refuses"):
        chaic.evaluate({"mine": Rhp}, track="hidden", out=tmp_path / "run", **OPTIONS)
    with pytest.raises(ValueError, match="hidden track needs --perception learned"):
        chaic.evaluate(Turner, track="hidden", perception="gt", out=tmp_path / "run", **OPTIONS)
    assert not (tmp_path / "run" / "run.json").exists()
    run = chaic.evaluate(Turner, track="hidden", out=tmp_path / "run", **OPTIONS)
    assert run.options["track"] == "hidden"
    run.verify()


def test_a_page_to_play_has_the_named_episodes(tmp_path):
    page = chaic.play("shopping/gen/7", out=tmp_path / "play.html")
    assert page.path == tmp_path / "play.html"
    assert "shopping/gen/7" in html.unescape(page.path.read_text())


def test_a_folder_of_episodes_is_a_path_or_a_string(tmp_path, episode):
    folder = write_short_episode(episode, tmp_path / "episodes", horizon=100)
    for name, episodes in [("path", folder), ("string", str(folder))]:
        run = chaic.evaluate(Turner, episodes=episodes, out=tmp_path / name, quiet=True)
        assert run.records()["frames"].tolist() == [100]


def test_records_match_results(tmp_path):
    run = chaic.evaluate(Turner, out=tmp_path / "run", **OPTIONS)
    records = run.records()
    assert records.dtype == chaic.Run.DTYPE and np.isfinite(records["tr"]).all()
    lines = (tmp_path / "run" / "results.jsonl").read_text().splitlines()
    assert json.loads(lines[0])["done"] == records["delivered"][0]


def test_results_are_read_line_by_line(tmp_path):
    class Fails(Turner):
        def act(self, observation):
            raise ValueError("a\u2028b")

    run = chaic.evaluate({"fails": Fails}, out=tmp_path / "run", **OPTIONS)
    assert "\u2028" in run.results()[0]["message"]
    path = tmp_path / "run" / "results.jsonl"
    result = json.loads(path.read_text())
    # Another task can have an episode of this id, and a killed run ends within a line.
    other = json.dumps({**result, "task": "shopping"})
    path.write_text(path.read_text() + other + "\n" + other[:40])
    assert sorted(run.records()["task"]) == sorted([result["task"], "shopping"])


def test_warnings_of_commands_hide_no_differences(tmp_path, episode):
    folder = write_short_episode(episode, tmp_path / "episodes", horizon=60)
    run = chaic.evaluate(baselines="none", episodes=folder, out=tmp_path / "run", quiet=True)
    with (run.path / "results.jsonl").open("a") as results:
        results.write('{"helper"')
    with pytest.warns(UserWarning, match="is cut off"):
        assert "TR" in run.report()
    (trace,) = (run.path / "traces").rglob("*.jsonl")
    trace.write_text(re.sub(r'"digest":"[0-9a-f]{16}"', f'"digest":"{"0" * 16}"', trace.read_text()))
    with pytest.raises(RuntimeError) as raised:
        run.verify()
    assert "is cut off" in str(raised.value) and "DIFFERS" in str(raised.value)


def test_old_option_names_warn(tmp_path):
    old = {name: value for name, value in OPTIONS.items() if name != "n_episodes"}
    with pytest.warns(DeprecationWarning, match="n_episodes"):
        run = chaic.evaluate(Turner, first=1, out=tmp_path / "run", **old)
    assert len(run.results()) == 1
    with pytest.warns(DeprecationWarning, match="baselines"):
        run = chaic.evaluate(beside=["none"], out=tmp_path / "none", **OPTIONS)
    assert run.options["helpers"] == ["none"]
    with pytest.raises(TypeError, match="n_episodes"):
        chaic.evaluate(Turner, first=1, out=tmp_path / "other", **OPTIONS)


def test_a_notebook_shows_why_a_run_has_no_report(tmp_path, monkeypatch):
    def fail(*_):
        raise RuntimeError("no finished <episode>")

    (tmp_path / "run.json").write_text("{}")
    monkeypatch.setattr("chaic.runs._command", fail)
    text = chaic.Run(tmp_path)._repr_html_()
    assert "no finished &lt;episode&gt;" in text and "<episode>" not in text
