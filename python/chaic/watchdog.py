"""Time limit for calls of Python helpers: a helper that exceeds it gets an exception, and the run continues."""

from __future__ import annotations

import ctypes
import threading
import time
from collections.abc import Callable
from typing import Any

from chaic._chaic import Briefing, Observation

#: Interval of the checks, seconds.
_INTERVAL_S = 0.1
#: Interval between repeated exceptions in a call that catches them, seconds.
_REPEAT_S = 1.0


class _TimeLimitExceeded(BaseException):
    """Raised in a call that exceeds its time limit. Handlers of ``Exception`` do not catch it."""


def _raise_in(thread: int, error: type[BaseException] | None) -> None:
    """Raises an exception in a thread when it next runs Python code; ``None`` cancels a pending one."""
    exception = None if error is None else ctypes.py_object(error)
    ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread), exception)


class Watchdog:
    """Ends calls that exceed the time limit; ``call`` then raises ``TimeoutError``.

    Python code can be stopped anywhere, a call into C (a sleep, a download, a matrix product) only when it returns.
    """

    def __init__(self, limit_s: float) -> None:
        if not limit_s > 0:
            raise ValueError(f"limit_s is {limit_s}, expected more than 0 seconds")
        self._limit_s = limit_s
        self._deadlines: dict[int, float] = {}
        #: Threads whose current call has exceeded the limit.
        self._expired: set[int] = set()
        self._lock = threading.Lock()
        self._done = threading.Event()

    def __enter__(self) -> Watchdog:
        threading.Thread(target=self._watch, name="chaic watchdog", daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._done.set()

    def _watch(self) -> None:
        while not self._done.wait(_INTERVAL_S):
            now = time.monotonic()
            with self._lock:
                for thread in [thread for thread, deadline in self._deadlines.items() if now > deadline]:
                    self._deadlines[thread] = now + _REPEAT_S
                    self._expired.add(thread)
                    _raise_in(thread, _TimeLimitExceeded)

    def call(self, name: str, function: Callable[..., Any], *arguments: Any) -> Any:
        """Calls a function in this thread with the time limit; ``name`` names the call in the error."""
        thread = threading.get_ident()
        with self._lock:
            self._expired.discard(thread)
            self._deadlines[thread] = time.monotonic() + self._limit_s
        result: Any = None
        error: BaseException | None = None
        # The exception may be raised anywhere until the deadline is removed.
        try:
            try:
                result = function(*arguments)
            except BaseException as raised:
                error = raised
            is_expired = self._end(thread)
        except _TimeLimitExceeded:
            # The interrupted `_end` may already have removed the thread from the expired threads.
            self._end(thread)
            is_expired = True
        if is_expired:
            problem = TimeoutError(f"{name} took longer than {self._limit_s:g} s")
            # The traceback shows the code that the call was executing.
            raise problem.with_traceback(None if error is None else error.__traceback__) from None
        if error is not None:
            raise error
        return result

    def _end(self, thread: int) -> bool:
        """Ends the current call of a thread; returns whether it has exceeded the limit."""
        with self._lock:
            is_expired = thread in self._expired
            self._deadlines.pop(thread, None)
            self._expired.discard(thread)
            if is_expired:
                # The exception may still be pending although the call has returned.
                _raise_in(thread, None)
            return is_expired


class TimeLimitedHelper:
    """Helper whose calls have a time limit."""

    def __init__(self, maker: Callable[[], Any], watchdog: Watchdog) -> None:
        self._watchdog = watchdog
        self._helper = watchdog.call("the creation of the helper", maker)

    def reset(self, briefing: Briefing) -> None:
        """Starts an episode."""
        self._watchdog.call("reset", self._helper.reset, briefing)

    def act(self, observation: Observation) -> Any:
        """Returns the next action of the helper."""
        return self._watchdog.call("act", self._helper.act, observation)
