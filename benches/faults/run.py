#!/usr/bin/env python3
"""Plays the benchmark with a language helper on a faulty endpoint, once for each kind of fault.

30 % of the requests of a run fail. An episode without a score is lost. Prints a table; the exit
status is 1 if an episode was lost. The endpoint is the stand-in, so scores say nothing about
language models.

usage: benches/faults/run.py [--out DIR] [--rate 0.3] [--helper llm] [--n-episodes N] [KIND ...]

Environment:
  BIN   folder of built programs (default: built by cargo build --release)
"""

import argparse
import json
import pathlib
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from programs import ROOT, programs, remove_run, serving  # noqa: E402

KINDS = """refused reset timeout slow-drip 429-with-wait 429 500 503 empty truncated wrong-schema
plan-not-listed huge invalid-utf8""".split()
# Short timeouts, since the stand-in answers at once; other settings have their defaults.
CONFIG = """
[endpoint]
timeout_secs = 0.3
[retry]
max_attempts = 8
initial_backoff_secs = 0.005
max_backoff_secs = 2.0
on_failure = "fallback"
"""


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("kinds", nargs="*", default=KINDS, metavar="KIND", help=" ".join(KINDS))
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "target/faults")
    parser.add_argument("--rate", type=float, default=0.3)
    parser.add_argument("--helper", default="llm")
    parser.add_argument("--n-episodes", type=int, help="number of episodes of each task")
    return parser.parse_args()


def play(chaic, standin, args, kind):
    """Plays a run under one kind of fault; returns the results of its episodes."""
    out = args.out / kind
    # Removes the run of an earlier call, whose results would be counted.
    remove_run(out)
    config = args.out / "timeouts.toml"
    config.write_text(CONFIG)
    faulty = [] if kind == "none" else ["--fault", f"{kind}={args.rate}"]
    with serving(standin, "--stall-ms", "2000", *faulty) as address:
        command = [chaic, "eval", "--split", "test", "--helper", args.helper, "--jobs", "8"]
        command += ["--llm-config", config, "--endpoint", address, "--model", "standin"]
        command += ["--no-traces", "--out", out]
        command += ["--n-episodes", str(args.n_episodes)] if args.n_episodes else []
        with open(args.out / f"{kind}.log", "w") as log:
            subprocess.run(command, stdout=log, stderr=log, check=False)
    results = out / "results.jsonl"
    # Without a result, all episodes are lost; the log has the reason.
    return [json.loads(line) for line in results.read_text().splitlines()] if results.exists() else []


def main():
    args = arguments()
    args.out.mkdir(parents=True, exist_ok=True)
    chaic, standin = programs()
    expected = 8 * (args.n_episodes or 12) * len(args.helper.split(","))
    print("| fault | episodes scored | questions | requests | failed | fallbacks | minutes |")
    print("|---|---|---|---|---|---|---|")
    lost = 0
    for kind in args.kinds:
        start = time.monotonic()
        results = play(chaic, standin, args, kind)
        minutes = (time.monotonic() - start) / 60.0
        scored = sum(r["status"] == "done" for r in results)
        lost += expected - scored
        # A failed episode has no counts.
        counts = [r.get("counts", {}) for r in results]
        total = lambda *names: sum(c.get(f"helper.{n}", 0) for c in counts for n in names)
        fallbacks = total("fallback_invalid", "fallback_fault")
        print(
            f"| {kind} | {scored} of {expected} | {total('questions')} | {total('requests')} "
            f"| {total('faults', 'invalid_answers')} | {fallbacks} | {minutes:.1f} |",
            flush=True,
        )
    return 1 if lost else 0


if __name__ == "__main__":
    sys.exit(main())
