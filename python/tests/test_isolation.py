"""Helpers in separate processes, in the sandbox of docs/threat-model.md."""

from __future__ import annotations

import base64
import json
import math
import os
import sys
from functools import partial
from pathlib import Path

import pytest

import chaic
from chaic._isolated import _maker, readable

OPTIONS = {"tasks": "low_target", "split": "train", "n_episodes": 1, "jobs": 2, "quiet": True}

# Another process must import the helpers, so a test fixture writes them to a separate file.
HELPERS = """
import json, os
from pathlib import Path

HOME = str(Path.home())

class Turner:
    images = ("depth",)
    image_size = 64

    def reset(self, briefing):
        self.n = 0

    def act(self, observation):
        self.n += 1
        return "turn_left" if self.n % 2 else {"wait": {"frames": 30}}

class Spy(Turner):
    def reset(self, briefing):
        found = {"pid": os.getpid(), "environment": sorted(os.environ)}
        for name, path in [("processes", "/proc"), ("home", HOME)]:
            try:
                found[name] = os.listdir(path)
            except OSError:
                found[name] = []
        raise RuntimeError("FOUND " + json.dumps(found))

class Counter(Turner):
    served = 0

    def reset(self, briefing):
        super().reset(briefing)
        Counter.served += 1

    def act(self, observation):
        print("text on standard output is not a message")
        if Counter.served > 1:
            raise RuntimeError(f"served {Counter.served}")
        return super().act(observation)

class Waiter(Turner):
    def __init__(self, frames):
        self.frames = frames

    def act(self, observation):
        return {"wait": {"frames": self.frames}}
"""


@pytest.fixture
def helpers(tmp_path, monkeypatch):
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "isolated_helpers.py").write_text(HELPERS)
    monkeypatch.syspath_prepend(folder)
    monkeypatch.delitem(sys.modules, "isolated_helpers", raising=False)
    import isolated_helpers

    yield isolated_helpers
    del sys.modules["isolated_helpers"]


def isolation_of(run):
    return json.loads((run.path / "run.json").read_text())["granted"]["isolation"]


def test_isolated_helpers_act_like_helpers_in_process(tmp_path, helpers):
    in_process = chaic.evaluate(helpers.Turner, out=tmp_path / "in_process", **OPTIONS)
    isolated = chaic.evaluate(helpers.Turner, isolate=True, out=tmp_path / "isolated", **OPTIONS)
    assert isolation_of(in_process) == {"turner": "trusted"}
    assert isolation_of(isolated)["turner"].startswith("sandbox")
    assert in_process.records().tolist() == isolated.records().tolist()
    isolated.verify()
    trace = next((isolated.path / "traces").rglob("*.jsonl"))
    assert '"isolation":"sandbox' in trace.read_text().splitlines()[0]


def test_helper_arguments_reach_the_process(tmp_path, helpers):
    maker = {"waiter": partial(helpers.Waiter, 50)}
    run = chaic.evaluate(maker, isolate=True, limit_s=math.inf, out=tmp_path / "run", **OPTIONS)
    assert not run.records()["failed"].any()


def test_an_isolated_helper_cannot_read_caller_or_home(tmp_path, helpers, monkeypatch):
    monkeypatch.setenv("CHAIC_TEST_API_KEY", "sesame")
    run = chaic.evaluate(helpers.Spy, isolate=True, out=tmp_path / "run", **OPTIONS)
    (result,) = run.results()
    message = next(text for text in result.values() if "FOUND " in str(text))
    found, _ = json.JSONDecoder().raw_decode(message.split("FOUND ")[-1])
    assert "CHAIC_TEST_API_KEY" not in found["environment"]
    if isolation_of(run)["spy"] == "sandbox":
        assert found["pid"] < 100
        assert str(os.getpid()) not in found["processes"]
        # The Python installation may be in the home folder.
        assert len(found["home"]) < len(os.listdir(Path.home()))


def test_folders_that_contain_the_home_or_the_current_folder_are_not_readable(tmp_path, helpers, monkeypatch):
    folder = tmp_path / "mine"
    (folder / "inner").mkdir()
    monkeypatch.chdir(tmp_path)
    assert str(folder) in readable(helpers.Turner)
    monkeypatch.setenv("HOME", str(folder))
    assert str(folder) not in readable(helpers.Turner)
    monkeypatch.setenv("HOME", str(tmp_path / "other"))
    monkeypatch.chdir(folder / "inner")
    assert str(folder) not in readable(helpers.Turner)
    assert str(folder / "isolated_helpers.py") in readable(helpers.Turner)


def test_the_script_is_readable_only_if_the_helper_needs_it(tmp_path, helpers, monkeypatch):
    script = str(tmp_path / "script.py")
    monkeypatch.setattr(sys.modules["__main__"], "__file__", script, raising=False)
    assert script not in readable(helpers.Turner)
    # An argument may come from the script.
    assert script in readable(partial(helpers.Waiter, "__main__"))


def test_a_process_serves_several_episodes(tmp_path, helpers):
    two = {**OPTIONS, "n_episodes": 2, "jobs": 1}
    run = chaic.evaluate(helpers.Counter, isolate=True, out=tmp_path / "run", **two)
    broken = run.records()["failed"]
    assert broken.sum() == 1
    assert "served 2" in json.dumps(run.results())


def test_a_helper_that_cannot_be_imported_is_refused(tmp_path, helpers):
    class Local(helpers.Turner):
        pass

    with pytest.raises(ValueError, match="at the top level of a file"):
        chaic.evaluate(Local, isolate=True, out=tmp_path / "run", **OPTIONS)
    large = {"waiter": partial(helpers.Waiter, bytes(100_000))}
    with pytest.raises(ValueError, match="too large for a command"):
        chaic.evaluate(large, isolate=True, out=tmp_path / "run", **OPTIONS)
    with pytest.raises(ValueError, match="isolate=True"):
        chaic.evaluate(helpers.Turner, read=["."], out=tmp_path / "run", **OPTIONS)
    for read in (["nowhere"], "nowhere", Path("nowhere")):
        with pytest.raises(ValueError, match="exec-read .*nowhere: "):
            chaic.evaluate(helpers.Turner, isolate=True, read=read, out=tmp_path / "run", **OPTIONS)
    assert not (tmp_path / "run").exists()


def test_the_script_of_a_package_can_import_its_neighbors(tmp_path, monkeypatch):
    package = tmp_path / "isolated_package"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "neighbor.py").write_text("class Mine: pass\n")
    (package / "main.py").write_text("from .neighbor import Mine\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setitem(sys.modules, "__main__", sys.modules["__main__"])
    monkeypatch.setitem(sys.modules, "__mp_main__", sys.modules["__main__"])
    # Protocol 0 names the class in text.
    pickled = b"c__main__\nMine\n."
    task = {"main": str(package / "main.py"), "package": "isolated_package", "maker": base64.b64encode(pickled).decode()}
    assert _maker(task).__name__ == "Mine"
