"""Benchmarks on a Ray cluster: shards of episode runs, joined in one folder.

Each task of Ray's plays one shard into a folder of its own and sends its files back, so that no file system need be
shared. A shard whose worker is lost is played again by another one.
"""

from __future__ import annotations

import importlib
import io
import os
import shutil
import tarfile
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from chaic.runs import Maker, Run, evaluate as evaluate_here, merge


def _packed(folder: Path) -> bytes:
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w:gz") as archive:
        archive.add(folder, arcname=".")
    return buffer.getvalue()


def _unpack(data: bytes, folder: Path) -> None:
    """Into a new folder, which appears as a whole or not at all."""
    unfinished = folder.with_name(folder.name + ".unfinished")
    shutil.rmtree(unfinished, ignore_errors=True)
    with tarfile.open(fileobj=io.BytesIO(data)) as archive:
        archive.extractall(unfinished, filter="data")
    unfinished.rename(folder)


def _play(
    helper: Maker | Mapping[str, Maker] | None, shard: str, jobs: int, options: Mapping[str, Any]
) -> bytes:
    """Plays a shard on the machine where this runs; the files of its folder."""
    with tempfile.TemporaryDirectory(prefix="chaic-shard-") as folder:
        out = Path(folder) / "run"
        evaluate_here(helper, out=out, jobs=jobs, shard=shard, quiet=True, **options)
        return _packed(out)


def evaluate(
    helper: Maker | Mapping[str, Maker] | None = None,
    *,
    out: str | os.PathLike[str],
    shards: int | None = None,
    jobs: int = 1,
    tries: int = 3,
    beside: Sequence[str] = (),
    **options: Any,
) -> Run:
    """Plays a benchmark as ``chaic.evaluate`` does, its shards as tasks of Ray's of ``jobs`` cores each.

    ``shards`` is usually four times as many as the cluster plays at a time. What is played is kept in ``out`` + ``.shards``: who calls
    this again after an interruption plays the rest. A shard is tried ``tries`` times before the run fails, whether
    its worker is lost or it raises. The folder ``out`` equals the one of a run on one machine but for the order of the
    lines in results.jsonl.
    """
    ray: Any = importlib.import_module("ray")
    if not ray.is_initialized():
        ray.init()
    if shards is None:
        cores = int(ray.cluster_resources().get("CPU", 1))
        shards = max(1, 4 * cores // jobs)
    parts = Path(f"{out}.shards")
    parts.mkdir(parents=True, exist_ok=True)
    remote = ray.remote(num_cpus=jobs, max_retries=0)(_play)
    given = {"beside": tuple(beside), **options}
    left = {k: tries for k in range(1, shards + 1) if not (parts / f"{k}-of-{shards}").is_dir()}
    pending: dict[Any, int] = {}
    while left or pending:
        for k in [k for k in left if k not in pending.values()]:
            pending[remote.remote(helper, f"{k}/{shards}", jobs, given)] = k
        done, _ = ray.wait(list(pending), num_returns=1)
        for reference in done:
            k = pending.pop(reference)
            try:
                data = ray.get(reference)
            except (ray.exceptions.RayError, OSError) as error:
                left[k] -= 1
                if left[k] == 0:
                    for other in pending:
                        ray.cancel(other, force=True)
                    raise RuntimeError(f"shard {k} of {shards} failed {tries} times") from error
            else:
                _unpack(data, parts / f"{k}-of-{shards}")
                del left[k]
    run = merge(out, [parts / f"{k}-of-{shards}" for k in range(1, shards + 1)], quiet=True)
    shutil.rmtree(parts)
    return run
