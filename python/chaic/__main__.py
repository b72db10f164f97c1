"""The command ``chaic``; it runs the same code as the Rust program."""

from __future__ import annotations

import signal
import sys

from chaic._chaic import run_command
from chaic._sandbox import launcher


def main() -> int:
    """Runs the command with the arguments of this process and returns its exit code."""
    # The command handles Ctrl-C itself.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return run_command(["chaic", *sys.argv[1:]], launcher())


if __name__ == "__main__":
    sys.exit(main())
