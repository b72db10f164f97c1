"""Start of the sandboxes of helper processes from a Python interpreter."""

from __future__ import annotations

import sys

from chaic import _chaic

# Loads the extension module only: the import of the package takes ten times as long, and each episode starts a sandbox.
_STAGE = """
import sys
from importlib.machinery import ExtensionFileLoader
from importlib.util import module_from_spec, spec_from_file_location
path = sys.argv.pop(1)
spec = spec_from_file_location("_chaic", path, loader=ExtensionFileLoader("_chaic", path))
module = module_from_spec(spec)
spec.loader.exec_module(module)
sys.exit(module.run_sandbox_stage(sys.argv))
"""


def launcher() -> list[str]:
    """Returns the program and arguments that start a stage of a sandbox."""
    return [sys.executable, "-I", "-S", "-c", _STAGE, _chaic.__file__]
