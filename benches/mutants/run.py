#!/usr/bin/env python3
"""Measures how many faults in the code the tests catch: mutation testing by cargo-mutants.

    benches/mutants/run.py [--shard K/N] [--out DIR] [AREA..]

cargo-mutants changes one operator, condition or return value at a time, and runs the tests of the
area's packages. Areas, all by default:

    world      rules of the world
    metrics    metrics and their uncertainty
    verify     re-simulation of recorded runs
    grants     what each agent observes, and which grants it has

--shard K/N takes every N-th mutant, from the K-th on. The script works on a copy of the checkout
under DIR (target/mutants by default), and prints a table, all mutants that no test caught, and the
standard error of a sample. Mutants that do not compile do not count. A mutant whose tests do not end
counts as caught.

Needs cargo-mutants (cargo install cargo-mutants --locked). All mutants take days on two cores.
"""

import argparse
import filecmp
import math
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# Outcomes of cargo-mutants, which writes a file with a line per mutant for each.
OUTCOMES = ("caught", "timeout", "missed", "unviable")


@dataclass
class Area:
    """Code that is changed, and packages whose tests run."""

    files: tuple[str, ...]
    packages: tuple[str, ...]
    cargo_arguments: tuple[str, ...] = ()
    test_arguments: tuple[str, ...] = ()


# The integration tests of chaic-eval concern helpers. Tests of interruptions and forged runs take most of the time of the
# others.
UNIT_TESTS = ("--lib",)
WITHOUT_INTERRUPTIONS = ("--", "--skip", "merging", "--skip", "starting")
# Slow tests of planners, starts of episodes and scores, which do not concern observations.
WITHOUT_SCORES = ("--skip", "forging", "--skip", "forecast", "--skip", "openings", "--skip", "helpers::")
AREAS = {
    "world": Area(
        ("crates/sim/chaic-world/src/**",),
        ("chaic-world", "chaic-reference", "chaic-goldens"),
    ),
    "metrics": Area(
        ("crates/eval/chaic-eval/src/metrics/**",),
        ("chaic-eval",),
        UNIT_TESTS,
        (*WITHOUT_INTERRUPTIONS, "--skip", "forging"),
    ),
    "verify": Area(
        ("crates/eval/chaic-eval/src/verify.rs", "crates/eval/chaic-eval/src/verify/**"),
        ("chaic-eval",),
        UNIT_TESTS,
        WITHOUT_INTERRUPTIONS,
    ),
    "grants": Area(
        (
            "crates/core/chaic-core/src/observation.rs",
            "crates/agents/chaic-env/src/agent_slot.rs",
            "crates/agents/chaic-env/src/observer.rs",
            "crates/agents/chaic-env/src/track.rs",
        ),
        ("chaic-core", "chaic-env", "chaic-eval"),
        (),
        (*WITHOUT_INTERRUPTIONS, *WITHOUT_SCORES),
    ),
}


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("areas", nargs="*", choices=[[], *AREAS], metavar="AREA")
    parser.add_argument("--shard", default="0/1", help="K/N: every N-th mutant from the K-th on")
    parser.add_argument("--out", type=Path, default=ROOT / "target/mutants")
    return parser.parse_args()


def copy_checkout(to):
    """Makes a folder equal to the committed and changed files of the checkout. Changed files get a new modification time."""
    listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(listed, cwd=ROOT, check=True, capture_output=True).stdout.decode().split("\0")
    files = {name for name in filter(None, names) if (ROOT / name).is_file()}
    for path in [path for path in to.rglob("*") if path.is_file()]:
        if str(path.relative_to(to)) not in files:
            path.unlink()
    for name in files:
        source, copy = ROOT / name, to / name
        # An interrupted run leaves a mutated file, which must be replaced by the original.
        if not copy.is_file() or not filecmp.cmp(source, copy, shallow=False):
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(source, copy)


def test(name, area, options, checkout):
    """Tests the mutants of an area; returns the mutants by outcome."""
    out = options.out / name
    shutil.rmtree(out, ignore_errors=True)
    command = ["cargo", "mutants", "--in-place", "--workspace", "--output", out, "--no-shuffle"]
    command += ["--shard", options.shard, "--sharding", "round-robin", "--colors", "never"]
    # The time limit is a multiple of the time without mutants, which varies on a loaded machine.
    command += ["--minimum-test-timeout", "300", "--timeout-multiplier", "8"]
    command += [word for pattern in area.files for word in ("--file", pattern)]
    command += [word for package in area.packages for word in ("--test-package", package)]
    command += [word for argument in area.cargo_arguments for word in ("--cargo-arg", argument)]
    command += [word for argument in area.test_arguments for word in ("--cargo-test-arg", argument)]
    # Compiling takes most of the time.
    environment = {
        "CARGO_TARGET_DIR": str(options.out / "target"),
        "CARGO_PROFILE_DEV_OPT_LEVEL": "1",
        "CARGO_PROFILE_DEV_DEBUG": "none",
        "CARGO_INCREMENTAL": "1",
    }
    ended = subprocess.run(command, cwd=checkout, env={**os.environ, **environment})
    # 2: mutants were missed, 3: tests ran too long.
    if ended.returncode not in (0, 2, 3):
        sys.exit(f"error: cargo mutants ended with exit status {ended.returncode}")
    folder = out / "mutants.out"
    return {outcome: (folder / f"{outcome}.txt").read_text().splitlines() for outcome in OUTCOMES}


def report(results):
    print("| area | mutants | caught | missed | share caught |\n|---|--:|--:|--:|--:|")
    for name, mutants in results.items():
        n_missed = len(mutants["missed"])
        n_caught = len(mutants["caught"]) + len(mutants["timeout"])
        n = n_caught + n_missed
        share = n_caught / n if n else math.nan
        error = math.sqrt(share * (1 - share) / n) if n else math.nan
        print(f"| {name} | {n} | {n_caught} | {n_missed} | {share:.3f} ± {error:.3f} |")
    for name, mutants in results.items():
        for mutant in mutants["missed"]:
            print(f"missed in {name}: {mutant}")


def main():
    options = arguments()
    options.out = options.out.resolve()
    if shutil.which("cargo-mutants") is None:
        sys.exit("error: cargo-mutants is missing; cargo install cargo-mutants --locked")
    checkout = options.out / "checkout"
    copy_checkout(checkout)
    # An interrupted compiler can leave damaged files.
    shutil.rmtree(options.out / "target/debug/incremental", ignore_errors=True)
    names = options.areas or list(AREAS)
    report({name: test(name, AREAS[name], options, checkout) for name in names})


if __name__ == "__main__":
    main()
