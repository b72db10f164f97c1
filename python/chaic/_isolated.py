"""Helpers in separate processes: the command line and the main function of such a process."""

from __future__ import annotations

import base64
import json
import os
import pickle
import shlex
import sys
import types
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from chaic import _chaic

#: Maximum length of a command in JSON. Linux allows 128 KiB for one argument, which also holds the readable paths.
_MAX_COMMAND = 100_000

_CODE = "import sys, json; sys.path[:] = json.loads(sys.argv[2]); from chaic._isolated import main; main(sys.argv[1])"


def command_line(maker: Callable[[], Any], images: Sequence[str], image_size: int) -> str:
    """Returns the shell command of a process that serves helpers that ``maker`` creates.

    Raises ``ValueError`` if another process cannot import ``maker``: it must be defined in a file. The same holds if its
    arguments are too large for a command.
    """
    main_file = _main_file()
    pickled = _pickled(maker)
    if b"__main__" in pickled and main_file is None:
        raise ValueError(_UNREACHABLE)
    task = {
        "main": main_file,
        "package": getattr(sys.modules["__main__"], "__package__", None),
        "maker": base64.b64encode(pickled).decode(),
        "images": list(images),
        "image_size": image_size,
    }
    path = [str(Path(entry).absolute()) for entry in sys.path]
    words = [sys.executable, "-c", _CODE, json.dumps(task), json.dumps(path)]
    command = "exec " + shlex.join(words)
    if len(json.dumps(command)) > _MAX_COMMAND:
        raise ValueError(
            f"the arguments of the helper are too large for a command: {len(pickled)} bytes; "
            "load large data from a file, which read=[...] makes readable"
        )
    return command


_UNREACHABLE = (
    "isolate=True needs a helper that another process can import: a class or function at the top level of a file"
)


def _pickled(maker: Callable[[], Any]) -> bytes:
    try:
        return pickle.dumps(maker)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise ValueError(f"{_UNREACHABLE}: {error}") from None


def without_partial(maker: Callable[[], Any]) -> Callable[..., Any]:
    """Returns the class or function of a ``functools.partial``, or ``maker`` itself."""
    while isinstance(maker, partial):
        maker = maker.func
    return maker


def readable(maker: Callable[[], Any]) -> list[str]:
    """Returns the files and folders that the process needs: the interpreter, installed packages, the helper's file.

    Folders of ``sys.path`` that contain the current or the home folder are left out, except for the helper's own file or
    package.
    """
    protected = [Path.cwd(), Path(os.path.expanduser("~")).resolve()]

    def is_too_wide(folder: Path) -> bool:
        real = folder.resolve()
        return any(path.is_relative_to(real) for path in protected)

    found = {sys.prefix, sys.base_prefix, sys.exec_prefix, str(Path(__file__).parent)}
    for entry in sys.path:
        folder = Path(entry).absolute()
        if folder.exists() and not is_too_wide(folder):
            found.add(str(folder))
    module = sys.modules.get(getattr(without_partial(maker), "__module__", None) or "")
    file = getattr(module, "__file__", None) or _main_file()
    if file is not None:
        if module is None or module.__name__ == "__main__":
            package = bool(getattr(sys.modules["__main__"], "__package__", None))
        else:
            package = "." in module.__name__
        path = Path(file).absolute()
        found.add(str(path.parent if package and not is_too_wide(path.parent) else path))
    main_file = _main_file()
    # The process runs the script only to import the helper from it.
    if main_file is not None and b"__main__" in _pickled(maker):
        found.add(main_file)
    return sorted(found)


def _main_file() -> str | None:
    file = getattr(sys.modules["__main__"], "__file__", None)
    return None if file is None else str(Path(file).absolute())


def main(text: str) -> None:
    """Serves helpers on standard input and output until the pipe is closed."""
    task = json.loads(text)
    # Output of the helper must not mix with the messages.
    output = os.dup(1)
    os.dup2(2, 1)
    maker = _maker(task)
    _chaic.serve(maker, task["images"], task["image_size"], output)


def _maker(task: dict[str, Any]) -> Any:
    pickled = base64.b64decode(task["maker"])
    if b"__main__" in pickled:
        # As in multiprocessing, the script runs under another name, so its main part is skipped.
        script = types.ModuleType("__mp_main__")
        script.__file__ = task["main"]
        # For relative imports of a script that was started by `python -m`.
        script.__package__ = task.get("package")
        # The bytes may declare their encoding.
        code = compile(Path(task["main"]).read_bytes(), task["main"], "exec")
        sys.modules["__main__"] = sys.modules["__mp_main__"] = script
        exec(code, script.__dict__)
    return pickle.loads(pickled)
