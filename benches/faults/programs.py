"""The programs that the commands of this folder try: those in the folder BIN, or built here."""

import os
import pathlib
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]


def programs():
    names = ("chaic", "chaic-llm-standin")
    if folder := os.environ.get("BIN"):
        return [pathlib.Path(folder) / name for name in names]
    packages = ["--package", "chaic", "--package", "chaic-llm-standin"]
    subprocess.run(["cargo", "build", "--release", "--quiet", *packages], cwd=ROOT, check=True)
    return [ROOT / "target/release" / name for name in names]
