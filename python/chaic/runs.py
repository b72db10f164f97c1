"""Whole benchmarks: helpers written in Python, and what came of a run."""

from __future__ import annotations

import base64
import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from chaic import _chaic, _isolated
from chaic._chaic import Briefing, Observation
from chaic._sandbox import launcher
from chaic.episodes import tasks_named
from chaic.watchdog import Watchdog, Watched


class Helper(Protocol):
    """What a helper is: a fresh one is made for each episode, briefed once, and asked whenever its action has ended.

    The class says by attributes what it is granted (docs/grants.md) and which images it wants; those that it doesn't
    have are as here.
    """

    grants: ClassVar[Sequence[str]] = ()
    images: ClassVar[Sequence[str]] = ("rgb", "depth")
    image_size: ClassVar[int] = 512

    def reset(self, briefing: Briefing) -> None:
        """Begins an episode."""

    def act(self, observation: Observation) -> Any:
        """What to do next: a string or dictionary as in docs/subprocess-helpers.md."""


#: Makes a fresh helper.
Maker = Callable[[], Any]


def _name_of(maker: Maker) -> str:
    name = getattr(maker, "__name__", type(maker).__name__)
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def evaluate(
    helper: Maker | Mapping[str, Maker] | None = None,
    *,
    tasks: str | Sequence[str] | None = None,
    split: str = "test",
    first: int | None = None,
    seeds: int | None = None,
    beside: Sequence[str] = (),
    out: str | os.PathLike[str] = "runs/python",
    jobs: int | None = None,
    resume: bool = False,
    shard: str | None = None,
    quiet: bool = False,
    limit_s: float = 600.0,
    isolate: bool = False,
    read: Sequence[str | os.PathLike[str]] = (),
    **options: Any,
) -> Run:
    """Plays a benchmark with a helper of yours into the folder ``out``, and gives the run.

    ``helper`` is a class (``Helper``) or another callable that makes a fresh helper for each episode, or several by
    name; they are to be granted alike. ``beside`` names built-in helpers to be compared with: ``"none"`` is
    what EI is counted against. ``jobs`` episodes are played at a time (usual: one a core); helpers
    of all of them share Python's lock. Further options are those of ``chaic eval``: ``episodes``, ``rules``,
    ``set``, ``traces``, ``perception``, ``behavior``, ``track``. With ``track="hidden"`` a class with other grants than
    ``goal_place`` is refused. The folder is like that of ``chaic eval``, so that ``chaic report``, ``chaic verify``
    and ``chaic replay`` read it.

    A helper that raises an exception gets zero for that episode, with the traceback in results.jsonl, and the run goes
    on. So does one that thinks for longer than ``limit_s`` seconds about one action: ``TimeoutError`` is raised in it. That
    stops Python code but no call into C; helpers who may hang there are better run as processes of their own
    (docs/subprocess-helpers.md).

    ``isolate=True`` runs the helpers in processes of their own, in the sandbox of docs/threat-model.md: they see their
    briefings and observations, installed packages, the file that defines them, and what ``read`` names. The process
    serves one episode after the other. The helper must be defined at the top of a file, so that it can be imported there.
    Without it a helper has all rights of this process, and the run records it as ``trusted``.

    ``KeyboardInterrupt`` stops it; ``resume=True`` goes on with it.
    """
    makers = _makers(helper)
    wants = {_wants(maker) for maker in makers.values()} or {((), ("rgb", "depth"), 512)}
    if len(wants) > 1:
        raise ValueError("helpers of one run are granted and see alike; give each a run of its own")
    ((grants, images, image_size),) = wants
    watchdog = Watchdog(limit_s)
    helpers: list[tuple[str, Maker | None]] = [(name, None) for name in beside]
    helpers += [(name, partial(Watched, maker, watchdog)) for name, maker in makers.items()]
    if not helpers:
        raise ValueError("name a helper, or some beside")
    options |= {"split": None if "episodes" in options else split, "first": first, "seeds": seeds}
    if tasks is not None:
        options["tasks"] = tasks_named(tasks)
    if read and not isolate:
        raise ValueError("read names what isolated helpers may read; give isolate=True with it")
    isolation = _isolation(makers, images, image_size, read, limit_s) if isolate else None
    options = {name: value for name, value in options.items() if value is not None}
    finished = 0

    def told(name: str, episode: str, seed: int, tr: float | None) -> bool:
        nonlocal finished
        finished += 1
        if not quiet:
            scored = "broke down" if tr is None else f"TR {tr:.2f}"
            _say(f"{finished}: {name}, {episode}, seed {seed}: {scored}")
        return True

    path = Path(out)
    with watchdog:
        report = _chaic.evaluate(
            helpers,
            path,
            granted=list(grants),
            images=list(images),
            image_size=image_size,
            jobs=jobs or os.cpu_count() or 1,
            resume=resume,
            shard=shard,
            isolation=isolation,
            go_on=told,
            options=options,
        )
    if report is None:
        raise KeyboardInterrupt("the run was stopped; resume=True goes on with it")
    if not quiet:
        _say(report)
    return Run(path)


def merge(
    out: str | os.PathLike[str], runs: Sequence[str | os.PathLike[str]], *, quiet: bool = False
) -> Run:
    """Joins the shards of a run in the new folder ``out``, as ``chaic merge`` does."""
    report = _chaic.merge(Path(out), [Path(run) for run in runs])
    if not quiet:
        _say(report)
    return Run(out)


def _makers(helper: Maker | Mapping[str, Maker] | None) -> dict[str, Maker]:
    if helper is None:
        return {}
    if isinstance(helper, Mapping):
        makers = dict(helper)
    else:
        makers = {_name_of(helper): helper}
    for name, maker in makers.items():
        if not callable(maker):
            raise TypeError(f"{name}: {maker!r} makes no helper; give a class or a function")
    return makers


def _isolation(
    makers: Mapping[str, Maker],
    images: Sequence[str],
    image_size: int,
    read: Sequence[str | os.PathLike[str]],
    limit_s: float,
) -> dict[str, Any]:
    readable = {str(Path(path).absolute()) for path in read}
    for maker in makers.values():
        readable.update(_isolated.readable(maker))
    return {
        "commands": [
            _isolated.command_line(maker, images, image_size) for maker in makers.values()
        ],
        "readable": sorted(readable),
        "launcher": launcher(),
        "decision_s": limit_s,
    }


def _wants(maker: Maker) -> tuple[tuple[str, ...], tuple[str, ...], int]:
    return (
        tuple(getattr(maker, "grants", Helper.grants)),
        tuple(getattr(maker, "images", Helper.images)),
        int(getattr(maker, "image_size", Helper.image_size)),
    )


class Replay:
    """A video of an episode, which notebooks show."""

    def __init__(self, path: Path) -> None:
        #: The file.
        self.path = path

    def _repr_html_(self) -> str:
        data = base64.b64encode(self.path.read_bytes()).decode()
        return f'<video controls src="data:video/mp4;base64,{data}"></video>'

    def __repr__(self) -> str:
        return f"Replay({str(self.path)!r})"


class Run:
    """A run's folder, with what came of it."""

    #: The columns of ``records``.
    DTYPE = np.dtype(
        [
            ("helper", "U64"),
            ("task", "U32"),
            ("episode", "U128"),
            ("seed", np.int64),
            ("broke_down", np.bool_),
            ("done", np.float64),
            ("total", np.float64),
            ("tr", np.float64),
            ("frames", np.int64),
        ]
    )

    def __init__(self, path: str | os.PathLike[str]) -> None:
        #: The folder.
        self.path = Path(path)
        if not (self.path / "run.json").is_file():
            raise FileNotFoundError(f"{self.path} is no run: there is no run.json")

    @property
    def options(self) -> dict[str, Any]:
        """What is played, by the names of run.json."""
        found: dict[str, Any] = json.loads((self.path / "run.json").read_text())["options"]
        return found

    def results(self) -> list[dict[str, Any]]:
        """All that is known of each episode run (docs/reference/trace.md), in the order of their keys."""
        path = self.path / "results.jsonl"
        if not path.exists():
            return []
        lines = [json.loads(line) for line in path.read_text().splitlines() if line]
        by_key = {(line["helper"], line["episode"], line.get("seed", 0)): line for line in lines}
        return [by_key[key] for key in sorted(by_key)]

    def records(self) -> NDArray[Any]:
        """One record an episode run, in the order of their keys."""
        results = self.results()
        records = np.zeros(len(results), self.DTYPE)
        for record, result in zip(records, results, strict=True):
            done, total = result.get("done", 0.0), result.get("total", 0.0)
            for name, value in [
                ("helper", result["helper"]),
                ("task", result["episode"].split("/")[0]),
                ("episode", result["episode"]),
                ("seed", result.get("seed", 0)),
                ("broke_down", "done" not in result),
                ("done", done),
                ("total", total),
                ("tr", done / total if total else 0.0),
                ("frames", result.get("frames", 0)),
            ]:
                record[name] = value
        return records

    def frame(self) -> Any:
        """The records as a pandas DataFrame."""
        import pandas

        return pandas.DataFrame(self.records())

    def report(self, format: str = "table") -> str:
        """The scores, as ``chaic report`` prints them."""
        return _command("report", str(self.path), "--format", format)

    def verify(self) -> str:
        """Plays the recorded actions again; ``RuntimeError`` if anything comes out otherwise."""
        return _command("verify", str(self.path))

    def replay(
        self, episode: str, *, helper: str | None = None, out: str | os.PathLike[str] | None = None
    ) -> Replay:
        """A video of an episode; in a file of its own if ``out`` is not given."""
        if out is None:
            out = Path(tempfile.mkdtemp(prefix="chaic-replay-")) / "replay.mp4"
        given = ["--helper", helper] if helper is not None else []
        _command("replay", str(self.path), episode, *given, "--out", str(out))
        return Replay(Path(out))

    def _repr_html_(self) -> str:
        return f"<pre>{self.report()}</pre>"

    def __repr__(self) -> str:
        return f"Run({str(self.path)!r})"


def _command(*arguments: str) -> str:
    """What the command prints; ``RuntimeError`` with its complaint if it fails."""
    call = [sys.executable, "-m", "chaic", *arguments]
    done = subprocess.run(call, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip() or done.stdout.strip())
    return done.stdout
