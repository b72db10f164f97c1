"""The command ``chaic``: the same code as the program's."""

from __future__ import annotations

import signal
import sys

from chaic._chaic import run_command
from chaic._sandbox import launcher


def main() -> int:
    """Runs the command with the arguments of this process; its exit code."""
    # The command takes Ctrl-C for itself.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return run_command(["chaic", *sys.argv[1:]], launcher())


if __name__ == "__main__":
    sys.exit(main())
