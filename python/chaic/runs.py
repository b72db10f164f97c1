"""Benchmark runs with Python helpers, and access to their results."""

from __future__ import annotations

import base64
import html
import json
import os
import re
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from chaic import _chaic, _deprecated, _isolated
from chaic._chaic import Briefing, Observation
from chaic._isolated import without_partial
from chaic._sandbox import launcher
from chaic.episodes import task_names
from chaic.watchdog import TimeLimitedHelper, Watchdog


class Helper(Protocol):
    """Interface of a helper. Each episode has a new helper, which acts whenever its previous action has ended.

    Class attributes request grants (docs/grants.md) and images; this class defines the defaults.
    """

    grants: ClassVar[Sequence[str]] = ()
    images: ClassVar[Sequence[str]] = ("rgb", "depth")
    image_size: ClassVar[int] = 512

    def reset(self, briefing: Briefing) -> None:
        """Starts an episode."""

    def act(self, observation: Observation) -> Any:
        """Returns the next action: a string or dictionary as in docs/subprocess-helpers.md."""


#: Callable that creates a helper.
Maker = Callable[[], Any]


#: Time limit of one action, seconds.
DEFAULT_LIMIT_S = 600.0

#: Maximum time limit of an isolated helper, seconds; about 30 years.
MAX_LIMIT_S = 1e9

#: Deprecated options of ``evaluate``, with their new names.
RENAMED_OPTIONS = {"first": "n_episodes", "beside": "baselines"}


def _names(names: str | Sequence[str]) -> tuple[str, ...]:
    return (names,) if isinstance(names, str) else tuple(names)


def _name_of(maker: Maker) -> str:
    maker = without_partial(maker)
    name = getattr(maker, "__name__", type(maker).__name__)
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()


def _print(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def evaluate(
    helper: Maker | Mapping[str, Maker] | None = None,
    *,
    tasks: str | Sequence[str] | None = None,
    split: str | None = None,
    n_episodes: int | None = None,
    seeds: int | None = None,
    baselines: str | Sequence[str] = (),
    out: str | os.PathLike[str] = "runs/python",
    jobs: int | None = None,
    resume: bool = False,
    shard: str | None = None,
    quiet: bool = False,
    limit_s: float | None = None,
    isolate: bool = False,
    read: str | os.PathLike[str] | Sequence[str | os.PathLike[str]] = (),
    **options: Any,
) -> Run:
    """Plays a benchmark with Python helpers into the folder ``out``, and returns the run.

    ``helper`` is a class (``Helper``), a ``functools.partial`` of one, or another callable that creates a helper for each
    episode, or several of them by name. All must request the same grants and images, as attributes of the callable.
    ``split`` is ``"test"`` by default. ``n_episodes`` limits the episodes of each task. ``baselines`` names built-in
    helpers for comparison; EI needs ``"none"``. ``jobs`` episodes run in parallel (default: one per core); their Python
    helpers share the interpreter lock. Further options are those of ``chaic eval``: ``episodes`` (instead of ``split``),
    ``rules``, ``set``, ``traces``, ``perception``, ``behavior``, ``track``. ``track="hidden"`` refuses all grants except
    ``goal_place``.
    ``chaic report``, ``chaic verify`` and ``chaic replay`` read the folder.

    A helper that raises an exception scores zero for that episode, with the traceback in results.jsonl, and the run
    continues. The same holds for one that needs more than ``limit_s`` seconds (600 by default) for one action: an exception
    is raised in it, which handlers of ``Exception`` do not catch. That stops Python code, but a call into C only when it
    returns. A helper that may hang there should be a separate process (docs/subprocess-helpers.md).

    ``isolate=True`` runs the helpers in separate processes in the sandbox of docs/threat-model.md. There a helper reads its
    briefings and observations, installed packages, the file that defines it, and the paths in ``read``. Each process serves
    one episode after the other. The helper must be defined at the top level of a file, so that the process can import it.
    Without isolation a helper has all rights of this process, and the run records it as ``trusted``.

    ``KeyboardInterrupt`` stops the run; ``resume=True`` continues it with the same helpers. Other options may then be
    omitted, and given ones must be those of the run. ``first`` and ``beside`` are deprecated names of ``n_episodes`` and
    ``baselines``.
    """
    if jobs is not None and jobs < 1:
        raise ValueError(f"jobs is {jobs}, expected at least 1")
    given = {"n_episodes": n_episodes, "baselines": _names(baselines) or None}
    options |= {name: value for name, value in given.items() if value is not None}
    _deprecated.rename_keys(options, RENAMED_OPTIONS)
    baselines = _names(options.pop("baselines", ()))
    makers = _makers(helper)
    requirements = {_requirements(maker) for maker in makers.values()}
    if len(requirements) > 1:
        raise ValueError(
            "the helpers of one run must request the same grants and images; evaluate them in separate runs"
        )
    grants, images, image_size = next(iter(requirements), _requirements(Helper))
    path = Path(out)
    if limit_s is None:
        limit_s = (_recorded_limit_s(path) if resume else None) or DEFAULT_LIMIT_S
    watchdog = Watchdog(limit_s)
    helpers: list[tuple[str, Maker | None]] = [(name, None) for name in baselines]
    helpers += [(name, partial(TimeLimitedHelper, maker, watchdog)) for name, maker in makers.items()]
    if not helpers:
        raise ValueError("give a helper or baselines")
    if options.get("episodes") is not None:
        options["episodes"] = os.fspath(options["episodes"])
    options |= {"split": split, "seeds": seeds}
    if tasks is not None:
        options["tasks"] = task_names(tasks)
    read = [read] if isinstance(read, (str, os.PathLike)) else list(read)
    if read and not isolate:
        raise ValueError("read applies to isolated helpers only; give isolate=True with it")
    isolation = _isolation(makers, images, image_size, read, limit_s) if isolate else None
    options = {name: value for name, value in options.items() if value is not None}
    n_finished = 0

    def on_result(name: str, episode: str, seed: int, tr: float | None) -> bool:
        nonlocal n_finished
        n_finished += 1
        if not quiet:
            score = "failed" if tr is None else f"TR {tr:.2f}"
            _print(f"{n_finished}: {name}, {episode}, seed {seed}: {score}")
        return True

    with watchdog:
        report = _chaic.evaluate(
            helpers,
            path,
            granted=list(grants),
            images=list(images),
            image_size=image_size,
            jobs=(os.cpu_count() or 1) if jobs is None else jobs,
            resume=resume,
            shard=shard,
            limit_s=limit_s,
            isolation=isolation,
            on_result=on_result,
            options=options,
        )
    if report is None:
        raise KeyboardInterrupt("the run was stopped; resume=True continues it")
    if not quiet:
        _print(report)
    return Run(path)


def merge(
    out: str | os.PathLike[str], runs: Sequence[str | os.PathLike[str]], *, quiet: bool = False
) -> Run:
    """Merges the shards of a run in the new folder ``out``, as ``chaic merge`` does."""
    report = _chaic.merge(Path(out), [Path(run) for run in runs])
    if not quiet:
        _print(report)
    return Run(out)


def _recorded_limit_s(path: Path) -> float | None:
    """Returns the time limit of the run in a folder, if it has one on record."""
    # `_chaic.evaluate` reports a damaged record.
    with suppress(OSError, ValueError, LookupError, TypeError, AttributeError, StopIteration):
        limits = json.loads((path / "run.json").read_bytes())["granted"]["limits_s"]
        return float(next(iter(limits.values())))
    return None


def _makers(helper: Maker | Mapping[str, Maker] | None) -> dict[str, Maker]:
    if helper is None:
        return {}
    if isinstance(helper, Mapping):
        makers = dict(helper)
    else:
        makers = {_name_of(helper): helper}
    for name, maker in makers.items():
        if not callable(maker):
            raise TypeError(f"{name}: {maker!r} is not callable; give a class or a function that creates a helper")
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
        "decision_s": min(limit_s, MAX_LIMIT_S),
    }


def _requirements(maker: Maker) -> tuple[tuple[str, ...], tuple[str, ...], int]:
    maker = without_partial(maker)
    return (
        _names(getattr(maker, "grants", Helper.grants)),
        _names(getattr(maker, "images", Helper.images)),
        int(getattr(maker, "image_size", Helper.image_size)),
    )


class Replay:
    """Video of an episode; notebooks show it."""

    def __init__(self, path: Path) -> None:
        #: Video file.
        self.path = path

    def _repr_html_(self) -> str:
        data = base64.b64encode(self.path.read_bytes()).decode()
        if self.path.suffix == ".gif":
            return f'<img alt="Replay" src="data:image/gif;base64,{data}">'
        return f'<video controls src="data:video/mp4;base64,{data}"></video>'

    def __repr__(self) -> str:
        return f"Replay({str(self.path)!r})"


class Page:
    """HTML page; notebooks show it in a frame. It needs no network."""

    def __init__(self, path: Path) -> None:
        #: HTML file.
        self.path = path

    def _repr_html_(self) -> str:
        content = html.escape(self.path.read_text(encoding="utf-8"))
        return f'<iframe title="chaic" style="border:0;height:60rem;width:100%" srcdoc="{content}"></iframe>'

    def __repr__(self) -> str:
        return f"Page({str(self.path)!r})"


class Run:
    """Folder of a run, with its results."""

    #: Columns of ``records``.
    DTYPE = np.dtype(
        [
            ("helper", "U64"),
            ("task", "U32"),
            ("episode", "U128"),
            ("seed", np.int64),
            ("failed", np.bool_),
            ("delivered", np.float64),
            ("wanted", np.float64),
            ("tr", np.float64),
            ("frames", np.int64),
        ]
    )

    def __init__(self, path: str | os.PathLike[str]) -> None:
        #: Folder of the run.
        self.path = Path(path)
        if not (self.path / "run.json").is_file():
            raise FileNotFoundError(f"{self.path} is not a run: it has no run.json")

    @property
    def options(self) -> dict[str, Any]:
        """Options of the run, with the names of run.json."""
        found: dict[str, Any] = json.loads((self.path / "run.json").read_bytes())["options"]
        return found

    def results(self) -> list[dict[str, Any]]:
        """Returns the results of all episode runs (docs/reference/trace.md), in the order of their keys."""
        path = self.path / "results.jsonl"
        if not path.exists():
            return []
        # Messages in the lines may contain other line separators. The last line of a killed run can be incomplete.
        *lines, _ = path.read_bytes().split(b"\n")
        results = [json.loads(line) for line in lines if line]
        by_key = {(r["helper"], r["task"], r["episode"], r.get("seed", 0)): r for r in results}
        return [by_key[key] for key in sorted(by_key)]

    def records(self) -> NDArray[Any]:
        """Returns one record per episode run, in the order of their keys."""
        results = self.results()
        records = np.zeros(len(results), self.DTYPE)
        for record, result in zip(records, results, strict=True):
            delivered, wanted = result.get("done", 0.0), result.get("total", 0.0)
            for name, value in [
                ("helper", result["helper"]),
                ("task", result["task"]),
                ("episode", result["episode"]),
                ("seed", result.get("seed", 0)),
                ("failed", "done" not in result),
                ("delivered", delivered),
                ("wanted", wanted),
                ("tr", delivered / wanted if wanted else 0.0),
                ("frames", result.get("frames", 0)),
            ]:
                record[name] = value
        return records

    def to_dataframe(self) -> Any:
        """Returns the records as a pandas DataFrame."""
        import pandas

        return pandas.DataFrame(self.records())

    def report(self, format: str = "table") -> str:
        """Returns the scores, as ``chaic report`` prints them."""
        return _command("report", str(self.path), "--format", format)

    def verify(self) -> str:
        """Replays the recorded actions and returns the summary. Raises ``RuntimeError`` on any difference."""
        return _command("verify", str(self.path))

    def replay(
        self, episode: str, *, helper: str | None = None, out: str | os.PathLike[str] | None = None
    ) -> Replay:
        """Renders a video of an episode, to a temporary file by default."""
        if out is None:
            out = Path(tempfile.mkdtemp(prefix="chaic-replay-")) / "replay.mp4"
        arguments = ["--helper", helper] if helper is not None else []
        _command("replay", str(self.path), episode, *arguments, "--out", str(out))
        return Replay(Path(out))

    def view(
        self,
        episode: str | None = None,
        *,
        helper: str | None = None,
        out: str | os.PathLike[str] | None = None,
    ) -> Page:
        """Writes a page with replays of an episode or of the whole run, to a temporary file by default."""
        path = _page_path(out)
        arguments = [episode] if episode is not None else []
        if helper is not None:
            arguments += ["--helper", helper]
        _command("view", str(self.path), *arguments, "--out", str(path))
        return Page(path)

    def _repr_html_(self) -> str:
        try:
            text = self.report()
        except RuntimeError as error:  # The command fails for example for a run without finished episodes.
            text = f"{self!r}: {error}"
        return f"<pre>{html.escape(text)}</pre>"

    def __repr__(self) -> str:
        return f"Run({str(self.path)!r})"


def play(*episodes: str, out: str | os.PathLike[str] | None = None) -> Page:
    """Writes a page in which a person plays these episodes as partner or helper; without any, a test episode of each
    task. The page is a temporary file by default."""
    path = _page_path(out)
    _command("play", *episodes, "--out", str(path))
    return Page(path)


def _page_path(out: str | os.PathLike[str] | None) -> Path:
    return Path(out) if out is not None else Path(tempfile.mkdtemp(prefix="chaic-page-")) / "page.html"


def _command(*arguments: str) -> str:
    """Runs the command and returns its output; its warnings become a ``UserWarning``.

    Raises ``RuntimeError`` with all that it prints if it fails: warnings and errors, then results, such as differences.
    """
    call = [sys.executable, "-m", "chaic", "--quiet", *arguments]
    done = subprocess.run(call, capture_output=True, encoding="utf-8", check=False)
    problems = done.stderr.strip()
    if done.returncode != 0:
        raise RuntimeError("\n".join(filter(None, [problems, done.stdout.strip()])))
    if problems:
        warnings.warn(problems, stacklevel=3)
    return done.stdout
