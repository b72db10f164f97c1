"""A run on Ray is the run that one machine makes, whatever becomes of its workers."""

import os
from pathlib import Path

import pytest

import chaic

ray = pytest.importorskip("ray")

KILLED = "CHAIC_TEST_KILLED"


class Turner:
    images = ("depth",)
    image_size = 32

    def reset(self, briefing):
        self.n = 0

    def act(self, observation):
        self.n += 1
        killed = Path(os.environ[KILLED])
        if self.n == 40 and not killed.exists():
            killed.touch()
            os._exit(1)
        return "turn_left"


def files(folder: Path) -> dict[str, bytes]:
    found = {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}
    found["results.jsonl"] = b"\n".join(sorted(found["results.jsonl"].splitlines()))
    return found


def test_a_worker_that_is_killed_costs_nothing(tmp_path):
    import chaic.ray

    killed = tmp_path / "killed"
    os.environ[KILLED] = str(killed)
    ray.init(num_cpus=4, runtime_env={"env_vars": {KILLED: str(killed)}}, log_to_driver=False)
    played = {"tasks": ["low_target", "shopping"], "split": "train", "first": 2, "beside": ["none"]}
    try:
        chaic.ray.evaluate(Turner, out=tmp_path / "ray", shards=4, **played)
    finally:
        ray.shutdown()
    assert killed.exists(), "one was killed in the middle"
    chaic.evaluate(Turner, out=tmp_path / "one", jobs=1, quiet=True, **played)
    assert files(tmp_path / "ray") == files(tmp_path / "one")
    assert not (tmp_path / "ray.shards").exists()
