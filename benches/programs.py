"""Programs for the scripts in `benches`: from the folder in the environment variable BIN, or built by cargo."""

import contextlib
import os
import pathlib
import re
import shutil
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[1]


def programs():
    """Returns the paths of chaic and of the stand-in for a language model."""
    names = ("chaic", "chaic-llm-standin")
    if folder := os.environ.get("BIN"):
        return [pathlib.Path(folder).resolve() / name for name in names]
    packages = ["--package", "chaic", "--package", "chaic-llm-standin"]
    subprocess.run(["cargo", "build", "--release", "--quiet", *packages], cwd=ROOT, check=True)
    # Cargo starts in ROOT, so a relative folder is one below it.
    target = ROOT / os.environ.get("CARGO_TARGET_DIR", "target")
    return [target / "release" / name for name in names]


def remove_run(folder):
    """Removes the run of an earlier call, since a new run is refused there. Other folders stay."""
    if (folder / "run.json").exists():
        shutil.rmtree(folder)


@contextlib.contextmanager
def serving(standin, *options):
    """Runs the stand-in and yields its address."""
    command = [standin, "--port", "0", *options]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        yield re.search(r"http://\S+", server.stdout.readline()).group()
    finally:
        server.kill()
        server.wait()
