"""Benchmarks with helpers written in Python."""

import json
import time

import numpy as np
import pytest

import chaic

ONE = {"tasks": "low_target", "split": "train", "first": 1, "jobs": 2, "quiet": True}


class Turner:
    """Turns, and never helps."""

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
    """The built-in helper, asked from Python."""

    def __init__(self) -> None:
        self.mind = chaic.Mind("rhp")

    grants = tuple(chaic.Mind("rhp").grants)
    images = ("depth", "ids")

    def reset(self, briefing: chaic.Briefing) -> None:
        self.mind.reset(briefing)

    def act(self, observation: chaic.Observation):
        return self.mind.act(observation)


def test_a_helper_of_ones_own_is_scored_and_verified(tmp_path):
    run = chaic.evaluate(Turner, beside=["none"], out=tmp_path / "run", **ONE)
    records = run.records()
    assert records["helper"].tolist() == ["none", "turner"]
    assert not records["broke_down"].any() and (records["total"] > 0).all()
    assert run.options["helpers"] == ["none", "turner"]
    assert "turner" in run.report()
    assert "turner" in (tmp_path / "run" / "report.md").read_text()
    run.verify()
    with pytest.raises(RuntimeError):
        chaic.evaluate(Turner, out=tmp_path / "run", **ONE)


def test_the_same_helper_from_python_and_from_rust_plays_the_same(tmp_path):
    run = chaic.evaluate({"mine": Rhp}, beside=["rhp"], out=tmp_path / "run", **ONE)
    mine, rhp = run.results()
    assert (mine["helper"], rhp["helper"]) == ("mine", "rhp")
    assert mine["digest"] == rhp["digest"] and mine["deliveries"] == rhp["deliveries"]


def test_a_helper_that_raises_gets_zero_and_the_run_goes_on(tmp_path):
    class Clumsy(Turner):
        def act(self, observation):
            if observation.frame > 200:
                raise KeyError("lost the plot")
            return super().act(observation)

    class Nonsense(Turner):
        def act(self, observation):
            return {"fly": "away"}

    class Unborn(Turner):
        def __init__(self):
            raise OSError("no such weights")

    makers = {"clumsy": Clumsy, "nonsense": Nonsense, "unborn": Unborn, "fine": Turner}
    chaic.evaluate(makers, out=tmp_path / "run", **ONE)
    results = {r["helper"]: r for r in chaic.Run(tmp_path / "run").results()}
    assert "lost the plot" in results["clumsy"]["message"]
    assert "test_runs.py" in results["clumsy"]["message"], "the traceback is kept"
    assert "no action" in results["nonsense"]["message"]
    assert "no such weights" in results["unborn"]["message"]
    assert "done" in results["fine"]
    assert chaic.Run(tmp_path / "run").records()["broke_down"].sum() == 3


def test_a_helper_that_hangs_gets_zero_and_the_run_goes_on(tmp_path):
    class Lost(Turner):
        def act(self, observation):
            while True:
                pass

    class Undecided(Turner):
        def reset(self, briefing):
            while True:
                time.sleep(0.01)

    makers = {"lost": Lost, "undecided": Undecided, "fine": Turner}
    run = chaic.evaluate(makers, out=tmp_path / "run", limit_s=1.0, **ONE)
    results = {r["helper"]: r for r in run.results()}
    assert "act took longer than 1 s" in results["lost"]["message"]
    assert "reset took longer than 1 s" in results["undecided"]["message"]
    assert "test_runs.py" in results["lost"]["message"], "it is told where"
    assert "done" in results["fine"]
    with pytest.raises(ValueError):
        chaic.evaluate(Turner, out=tmp_path / "other", limit_s=0.0, **ONE)


def test_a_run_that_was_interrupted_goes_on(tmp_path):
    class Impatient(Turner):
        def act(self, observation):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        chaic.evaluate({"turner": Impatient}, out=tmp_path / "run", **ONE)
    run = chaic.evaluate(Turner, out=tmp_path / "run", resume=True, **ONE)
    assert len(run.results()) == 1


def test_mistakes_are_told(tmp_path):
    out = tmp_path / "run"
    for kind, call in [
        (ValueError, lambda: chaic.evaluate(out=out, **ONE)),
        (TypeError, lambda: chaic.evaluate({"mine": 3}, out=out, **ONE)),
        (ValueError, lambda: chaic.evaluate({"rhp": Turner}, out=out, **ONE)),
        (ValueError, lambda: chaic.evaluate({"a": Turner, "b": Rhp}, out=out, **ONE)),
        (ValueError, lambda: chaic.evaluate(Turner, out=out, **{**ONE, "tasks": "flying"})),
        (TypeError, lambda: chaic.evaluate(Turner, out=out, colour="red", **ONE)),
        (FileNotFoundError, lambda: chaic.Run(tmp_path / "nothing")),
    ]:
        with pytest.raises(kind):
            call()
    assert not out.exists()


def test_the_hidden_track_refuses_grants_and_is_recorded(tmp_path):
    with pytest.raises(RuntimeError, match="`mine` is granted ids, which the hidden track refuses"):
        chaic.evaluate({"mine": Rhp}, track="hidden", out=tmp_path / "run", **ONE)
    with pytest.raises(RuntimeError, match="hidden track needs --perception learned"):
        chaic.evaluate(Turner, track="hidden", perception="gt", out=tmp_path / "run", **ONE)
    assert not (tmp_path / "run" / "run.json").exists()
    run = chaic.evaluate(Turner, track="hidden", out=tmp_path / "run", **ONE)
    assert run.options["track"] == "hidden"
    run.verify()


def test_records_are_plain_numbers(tmp_path):
    run = chaic.evaluate(Turner, out=tmp_path / "run", **ONE)
    records = run.records()
    assert records.dtype == chaic.Run.DTYPE and np.isfinite(records["tr"]).all()
    lines = (tmp_path / "run" / "results.jsonl").read_text().splitlines()
    assert json.loads(lines[0])["done"] == records["done"][0]
