"""Metadata of exported data sets, read by the library of the Croissant format."""

import subprocess
import sys

import pytest

mlcroissant = pytest.importorskip("mlcroissant")

# The library uses deprecated parts of rdflib and pandas.
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")


def command(*arguments: str) -> None:
    subprocess.run([sys.executable, "-m", "chaic", *arguments, "--quiet"], check=True)


def test_records_of_a_split_are_loaded(tmp_path):
    split = ["--split", "gen:3..5", "--task", "moving_house"]
    command("export", "episodes", *split, "--out", str(tmp_path / "set"))
    dataset = mlcroissant.Dataset(tmp_path / "set" / "croissant.json")
    assert not dataset.metadata.issues.errors
    records = sorted(dataset.records("episodes"), key=lambda record: record["episodes/seed"])
    assert [record["episodes/seed"] for record in records] == [3, 4]
    assert records[0]["episodes/task"] == b"moving_house"


def test_frames_of_a_run_are_loaded(tmp_path):
    run = str(tmp_path / "run")
    command("eval", "--task", "moving_house", "--n-episodes", "1", "--helper", "none", "--out", run)
    options = ["--agent", "partner", "--size", "32", "--every", "30"]
    command("export", "lerobot", run, *options, "--out", str(tmp_path / "set"))
    dataset = mlcroissant.Dataset(tmp_path / "set" / "croissant.json")
    assert not dataset.metadata.issues.errors
    frames = list(dataset.records("frames"))
    assert len(frames) > 10
    assert [frame["frames/frame_index"] for frame in frames] == list(range(len(frames)))
    assert len(frames[0]["frames/observation.state"]) == 9
