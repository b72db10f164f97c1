"""A limit to how long a helper may think: who hangs gets an exception, and the run goes on."""

from __future__ import annotations

import ctypes
import threading
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import Any

from chaic._chaic import Briefing, Observation

#: How often it is looked whether somebody thinks for too long, seconds.
_LOOK_S = 0.1


def _raise_in(thread: int, error: type[BaseException] | None) -> None:
    """Lets a thread raise an exception when it runs Python code next; ``None`` takes that back."""
    what = None if error is None else ctypes.py_object(error)
    ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread), what)


class Watchdog:
    """Raises ``TimeoutError`` in threads that stay in ``limit`` for too long.

    Python code can be stopped anywhere, a call into C (a sleep, a download, a matrix product) only when it returns.
    """

    def __init__(self, limit_s: float) -> None:
        if not limit_s > 0:
            raise ValueError(f"a limit of {limit_s} s leaves no time to think; give more than 0")
        self._limit_s = limit_s
        self._until: dict[int, float] = {}
        self._lock = threading.Lock()
        self._done = threading.Event()

    def __enter__(self) -> Watchdog:
        threading.Thread(target=self._watch, name="chaic watchdog", daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._done.set()

    def _watch(self) -> None:
        while not self._done.wait(_LOOK_S):
            now = time.monotonic()
            with self._lock:
                for thread in [thread for thread, until in self._until.items() if now > until]:
                    del self._until[thread]
                    _raise_in(thread, TimeoutError)

    @contextmanager
    def limit(self, what: str) -> Generator[None]:
        """Within it, this thread may stay for so long."""
        thread = threading.get_ident()
        with self._lock:
            self._until[thread] = time.monotonic() + self._limit_s
        try:
            yield
        except TimeoutError as error:
            if not error.args:
                error.args = (f"{what} took longer than {self._limit_s:g} s",)
            raise
        finally:
            with self._lock:
                if self._until.pop(thread, None) is None:
                    # It may not have been raised yet, and there is nothing left to be stopped.
                    _raise_in(thread, None)


class Watched:
    """A helper whose every thought is limited."""

    def __init__(self, make: Callable[[], Any], watchdog: Watchdog) -> None:
        self._watchdog = watchdog
        with watchdog.limit("making the helper"):
            self._helper = make()

    def reset(self, briefing: Briefing) -> None:
        """Briefs the helper."""
        with self._watchdog.limit("reset"):
            self._helper.reset(briefing)

    def act(self, observation: Observation) -> Any:
        """Asks the helper."""
        with self._watchdog.limit("act"):
            return self._helper.act(observation)
