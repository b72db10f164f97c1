#!/usr/bin/env python3
"""Checks that other processors compute bit-identical worlds and images.

    benches/goldens/run.py [--install] [TARGET..]

Builds `chaic-goldens` for each target, runs it, and compares its output with
`crates/dev/chaic-goldens/goldens.txt`. Targets, all by default:

    x86-64        a native build (tests cover each vector width)
    x86-64-v3     compiled for AVX2 and fused multiply-add
    aarch64       Debian's cross compiler and qemu-user
    wasm32        Node and its WASI

`--install` adds the standard library of a target with `rustup target add`. Exit status: 0 if all
are equal, 1 if one differs or fails, 3 if a named prerequisite is missing.
"""

import argparse
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TABLE = ROOT / "crates/dev/chaic-goldens/goldens.txt"
TARGET_DIR = ROOT / os.environ.get("CARGO_TARGET_DIR", "target")
SYSROOT = "/usr/aarch64-linux-gnu"


@dataclass
class Target:
    """Build and run settings of a processor."""

    triple: str
    programs: dict[str, str] = field(default_factory=dict)  # required program -> how to install it
    environment: dict[str, str] = field(default_factory=dict)
    runner: list[str] = field(default_factory=list)
    suffix: str = ""


TARGETS = {
    "x86-64": Target("x86_64-unknown-linux-gnu"),
    "x86-64-v3": Target(
        "x86_64-unknown-linux-gnu",
        environment={"RUSTFLAGS": "-C target-cpu=x86-64-v3"},
    ),
    "aarch64": Target(
        "aarch64-unknown-linux-gnu",
        programs={
            "aarch64-linux-gnu-gcc": "apt-get install gcc-aarch64-linux-gnu libc6-dev-arm64-cross",
            "qemu-aarch64": "apt-get install qemu-user",
        },
        environment={"CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER": "aarch64-linux-gnu-gcc"},
        runner=["qemu-aarch64", "-L", SYSROOT],
    ),
    "wasm32": Target(
        "wasm32-wasip1",
        programs={"node": "install Node 20 or later"},
        runner=["node", "--no-warnings", str(Path(__file__).with_name("wasi.mjs"))],
        suffix=".wasm",
    ),
}


def missing(target: Target, install: bool) -> list[str]:
    """Returns the missing prerequisites and how to install them."""
    missing_items = [f"{name} ({how})" for name, how in target.programs.items() if not shutil.which(name)]
    out = subprocess.run(["rustc", "--print", "target-libdir", "--target", target.triple],
                         capture_output=True, text=True, cwd=ROOT)
    has_library = out.returncode == 0 and Path(out.stdout.strip()).is_dir()
    if not has_library and install:
        has_library = subprocess.run(["rustup", "target", "add", target.triple], cwd=ROOT).returncode == 0
    if not has_library:
        missing_items.append(f"Rust's standard library (rustup target add {target.triple}, or --install)")
    return missing_items


def print_goldens(name: str, target: Target) -> str:
    """Returns the output of the program on this target."""
    folder = TARGET_DIR / "goldens" / name
    environment = os.environ | target.environment | {"CARGO_TARGET_DIR": str(folder)}
    build = ["cargo", "build", "--locked", "--quiet", "-p", "chaic-goldens", "--target", target.triple]
    subprocess.run(build, check=True, cwd=ROOT, env=environment)
    program = folder / target.triple / "debug" / f"chaic-goldens{target.suffix}"
    run = subprocess.run([*target.runner, str(program)], stdout=subprocess.PIPE, text=True)
    # Exit status 1 means a difference, which the caller reports.
    if run.returncode not in (0, 1) or not run.stdout:
        raise subprocess.CalledProcessError(run.returncode, run.args)
    return run.stdout


def differing(found: str, expected: str) -> list[str]:
    """Returns the lines that differ from the committed ones."""
    a, b = found.splitlines(), expected.splitlines()
    lines = [f"    {x}\n    committed: {y}" for x, y in zip(a, b) if x != y]
    return lines + ([f"    {len(a)} lines, committed: {len(b)}"] if len(a) != len(b) else [])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("targets", nargs="*", metavar="TARGET", help=", ".join(TARGETS))
    parser.add_argument("--install", action="store_true", help="add Rust's standard library of a target")
    options = parser.parse_args()
    unknown = [t for t in options.targets if t not in TARGETS]
    if unknown:
        parser.error(f"unknown target {unknown[0]}; use {', '.join(TARGETS)}")
    expected = TABLE.read_text()
    outcomes = {}
    for name in options.targets or TARGETS:
        target = TARGETS[name]
        if missing_items := missing(target, options.install):
            outcomes[name] = "MISSING " + "; ".join(missing_items)
            continue
        print(f"== {name}: building and running", flush=True)
        try:
            lines = differing(print_goldens(name, target), expected)
        except subprocess.CalledProcessError as problem:
            outcomes[name] = f"FAILED {problem}"
            continue
        outcomes[name] = f"DIFFERS in {len(lines)} lines" if lines else "equal"
        print("\n".join(lines), end="\n" if lines else "")
    print(f"\n{len(expected.splitlines())} lines of {TABLE.relative_to(ROOT)}:")
    for name, outcome in outcomes.items():
        print(f"  {name:<12}{outcome}")
    if any(v.startswith(("DIFFERS", "FAILED")) for v in outcomes.values()):
        return 1
    return 3 if any(v.startswith("MISSING") for v in outcomes.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
