"""Benchmark runs on a Ray cluster: each Ray task plays one shard, and the shards are merged in one folder.

A task returns the files of its shard, so the cluster needs no shared file system. If a worker is lost, another one repeats
its shard.
"""

from __future__ import annotations

import importlib
import io
import os
import shutil
import tarfile
import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from chaic import _deprecated
from chaic.runs import RENAMED_OPTIONS, Maker, Run, evaluate as evaluate_locally, merge


def _pack(folder: Path) -> bytes:
    """Returns the files of a folder as an archive."""
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w:gz") as archive:
        archive.add(folder, arcname=".")
    return buffer.getvalue()


def _unpack(data: bytes, folder: Path) -> None:
    """Unpacks an archive into a new folder, which appears only when it is complete."""
    unfinished = folder.with_name(folder.name + ".unfinished")
    shutil.rmtree(unfinished, ignore_errors=True)
    with tarfile.open(fileobj=io.BytesIO(data)) as archive:
        archive.extractall(unfinished, filter="data")
    unfinished.rename(folder)


def _play(
    helper: Maker | Mapping[str, Maker] | None, shard: str, jobs: int, options: Mapping[str, Any]
) -> bytes:
    """Plays a shard on this machine and returns the files of its folder."""
    with tempfile.TemporaryDirectory(prefix="chaic-shard-") as folder:
        out = Path(folder) / "run"
        evaluate_locally(helper, out=out, jobs=jobs, shard=shard, quiet=True, **options)
        return _pack(out)


def _play_missing(ray: Any, start: Callable[[int], Any], folders: Mapping[int, Path], tries: int) -> None:
    """Plays the shards whose folders do not exist yet; ``start`` starts the task of a shard."""
    remaining_tries = {k: tries for k, folder in folders.items() if not folder.is_dir()}
    pending: dict[Any, int] = {}
    try:
        while remaining_tries or pending:
            for k in [k for k in remaining_tries if k not in pending.values()]:
                pending[start(k)] = k
            done, _ = ray.wait(list(pending), num_returns=1)
            for reference in done:
                k = pending.pop(reference)
                try:
                    data = ray.get(reference)
                except (ray.exceptions.RayError, OSError) as error:
                    # A call with wrong arguments would fail again, so it is not repeated.
                    if isinstance(error, (ValueError, TypeError)):
                        raise
                    remaining_tries[k] -= 1
                    if remaining_tries[k] == 0:
                        problem = f"shard {k} of {len(folders)} failed {tries} times"
                        if any(folder.is_dir() for folder in folders.values()):
                            parts = folders[k].parent
                            problem += f"; {parts} keeps the finished shards, and the same call plays the missing ones"
                        raise RuntimeError(problem) from error
                else:
                    _unpack(data, folders[k])
                    del remaining_tries[k]
    except BaseException:
        # Cancels the tasks, also after Ctrl-C. Otherwise they would occupy the cluster.
        for other in pending:
            ray.cancel(other, force=True)
        raise


def _remove_unfinished(parts: Path) -> None:
    """Removes incomplete shards, and the folder of the shards if it has no others."""
    for folder in parts.glob("*.unfinished"):
        shutil.rmtree(folder, ignore_errors=True)
    # `rmdir` fails if there are finished shards, which stay.
    with suppress(OSError):
        parts.rmdir()


def evaluate(
    helper: Maker | Mapping[str, Maker] | None = None,
    *,
    out: str | os.PathLike[str],
    shards: int | None = None,
    jobs: int = 1,
    tries: int = 3,
    baselines: str | Sequence[str] = (),
    **options: Any,
) -> Run:
    """Plays a benchmark as ``chaic.evaluate`` does, with its shards as Ray tasks of ``jobs`` cores each.

    ``shards`` defaults to four times the number of shards that the cluster plays in parallel. Finished shards stay in ``out``
    + ``.shards`` until they are merged; a call after an interruption or a failure plays the missing ones. The run fails after
    ``tries`` failures of a shard, which are exceptions and lost workers. ``quiet=False`` prints the report.

    The folder ``out`` equals that of a run on one machine, except for the order of lines in results.jsonl. ``first`` and
    ``beside`` are deprecated names of ``n_episodes`` and ``baselines``.
    """
    if baselines:
        options["baselines"] = baselines
    _deprecated.rename_keys(options, RENAMED_OPTIONS)
    quiet = bool(options.pop("quiet", True))
    for name, number in [("shards", shards), ("jobs", jobs), ("tries", tries)]:
        if number is not None and number < 1:
            raise ValueError(f"{name} is {number}, expected at least 1")
    if Path(out).exists() and any(Path(out).iterdir()):
        raise ValueError(f"{out} is not empty; choose another folder")
    ray: Any = importlib.import_module("ray")
    if not ray.is_initialized():
        ray.init()
    parts = Path(f"{out}.shards")
    if shards is None:
        # After an interruption, the cluster can have another size. The number of shards must not change.
        earlier = {int(folder.name.split("-of-")[1]) for folder in parts.glob("*-of-*[0-9]")}
        shards = earlier.pop() if len(earlier) == 1 else None
    if shards is None:
        cores = int(ray.cluster_resources().get("CPU", 1))
        shards = max(1, 4 * cores // jobs)
    folders = {k: parts / f"{k}-of-{shards}" for k in range(1, shards + 1)}
    remote = ray.remote(num_cpus=jobs, max_retries=0)(_play)

    def start(shard: int) -> Any:
        return remote.remote(helper, f"{shard}/{shards}", jobs, options)

    parts.mkdir(parents=True, exist_ok=True)
    try:
        _play_missing(ray, start, folders, tries)
    finally:
        _remove_unfinished(parts)
    try:
        run = merge(out, list(folders.values()), quiet=quiet)
    except (ValueError, RuntimeError) as error:
        raise RuntimeError(f"{error}; {parts} keeps the finished shards: remove it to play them again") from error
    shutil.rmtree(parts)
    return run
