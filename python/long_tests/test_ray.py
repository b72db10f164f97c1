"""A run on Ray equals the run of one machine, also after the loss of a worker."""

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


def test_the_loss_of_a_worker_does_not_change_the_run(tmp_path):
    import chaic.ray

    killed = tmp_path / "killed"
    os.environ[KILLED] = str(killed)
    ray.init(num_cpus=4, runtime_env={"env_vars": {KILLED: str(killed)}}, log_to_driver=False)
    options = {"tasks": ["low_target", "shopping"], "split": "train", "n_episodes": 2, "baselines": ["none"]}
    try:
        chaic.ray.evaluate(Turner, out=tmp_path / "ray", shards=4, **options)
    finally:
        ray.shutdown()
    assert killed.exists(), "a worker was killed during its shard"
    chaic.evaluate(Turner, out=tmp_path / "one", jobs=1, quiet=True, **options)
    assert files(tmp_path / "ray") == files(tmp_path / "one")
    assert not (tmp_path / "ray.shards").exists()
