#!/usr/bin/env python3
"""Kills a run at every system call of its first moment, and completes it.

The script traces the system calls of a first run's main thread, from the first call that names the
run's folder, for --seconds. For each call it kills another run at the entry of that call. It then
resumes the run if its folder holds run.json, and otherwise starts it again. All files must equal
those of an undisturbed run byte by byte, except for the order of lines in `results.jsonl`. Prints a
line for each failure and the counts; the exit status is 1 after a failure, or if no run was killed.

usage: benches/faults/first_moment.py [--out DIR] [--seconds 1] [--every 1] [--model]

--model plays a language helper on the stand-in, so the run also writes settings and templates. Needs Linux and strace (Debian: apt-get install strace).

Environment:
  BIN   folder of built programs (default: built by cargo build --release)
"""

import argparse
import collections
import json
import pathlib
import re
import shutil
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from programs import ROOT, programs, serving  # noqa: E402

# Enough for a few decisions of each agent.
FRAMES = 40
TASKS = ("no_constraint", "shopping")
CALL = re.compile(r"^(\d+) +(\d+\.\d+) (\w+)\(")


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "target/first_moment")
    parser.add_argument("--seconds", type=float, default=1.0, help="traced duration")
    parser.add_argument("--every", type=int, default=1, help="kill only at every N-th call")
    parser.add_argument("--model", action="store_true", help="play a language helper")
    return parser.parse_args()


def short_episodes(chaic, folder):
    for task in TASKS:
        generate = [chaic, "episodes", "generate", "--task", task, "--seeds", "0..1"]
        subprocess.run([*generate, "--out", folder], check=True, stdout=subprocess.DEVNULL)
    for path in folder.glob("*.json"):
        episode = json.loads(path.read_text())
        episode["setup"]["horizon"] = FRAMES
        path.write_text(json.dumps(episode))


def main_thread_calls(log, folder, seconds):
    """Returns the main thread's calls from the first that names the folder, as (name, count of this
    name so far)."""
    counts, calls, main, start = collections.Counter(), [], None, None
    for line in log.read_text(errors="replace").splitlines():
        if not (match := CALL.match(line)):
            continue
        thread, time, name = match[1], float(match[2]), match[3]
        main = main or thread
        if thread != main:
            continue
        counts[name] += 1
        if start is None and folder.name in line and name != "execve":
            start = time
        if start is not None and time - start <= seconds:
            calls.append((name, counts[name]))
    return calls


def files(folder):
    """Returns the files of a run by path, without the lock and the language model's records. Sorts the
    lines of results.jsonl, whose order is not specified."""
    paths = (p for p in folder.rglob("*") if p.is_file() and p.name != ".lock")
    found = {str(p.relative_to(folder)): p.read_bytes() for p in paths}
    if results := found.get("results.jsonl"):
        found["results.jsonl"] = b"".join(sorted(results.splitlines(keepends=True)))
    is_model_record = re.compile(r"llm/(?!settings|templates)").match
    return {name: data for name, data in found.items() if not is_model_record(name)}


def differences(a, b):
    return sorted(name for name in a.keys() | b.keys() if a.get(name) != b.get(name))


def run(command):
    return subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL)


def complete(chaic, start, model_options, folder):
    """Completes a killed run; returns an error message, or None."""
    is_run = (folder / "run.json").exists()
    resume = [chaic, "eval", "--resume", *model_options, "--out", folder]
    ended = run(resume if is_run else start)
    if ended.returncode != 0:
        how = "resumed" if is_run else "started again"
        return f"{how}: exit code {ended.returncode}: {ended.stderr.strip()}"
    return None


def main():
    args = arguments()
    shutil.rmtree(args.out, ignore_errors=True)
    args.out.mkdir(parents=True)
    chaic, standin = programs()
    short_episodes(chaic, args.out / "episodes")
    if not args.model:
        return kill_everywhere(args, chaic, [])
    with serving(standin) as address:
        return kill_everywhere(args, chaic, ["--endpoint", address, "--model", "standin"])


def kill_everywhere(args, chaic, model_options):
    folder = args.out / "run"
    helper = "llm" if model_options else "none"
    eval_ = [chaic, "eval", "--episodes", args.out / "episodes", "--helper", helper, "--jobs", "1"]
    start = [*eval_, "--size", "16", *model_options, "--out", folder]
    log = args.out / "calls.log"
    traced = run(["strace", "-f", "-ttt", "-o", log, *start])
    if traced.returncode != 0:
        sys.exit(f"the first run failed: {traced.stderr}")
    expected = files(folder)
    calls = main_thread_calls(log, folder, args.seconds)[:: args.every]
    failures, killed, states = 0, 0, collections.Counter()
    for name, k in calls:
        shutil.rmtree(folder, ignore_errors=True)
        kill = f"inject={name}:signal=KILL:when={k}"
        ended = run(["strace", "-f", "-o", "/dev/null", "-e", kill, *start])
        killed += ended.returncode in (-9, 137)
        state = "nothing" if not folder.exists() else "before run.json"
        states["run.json" if (folder / "run.json").exists() else state] += 1
        problem = complete(chaic, start, model_options, folder)
        if not problem and (changed := differences(files(folder), expected)):
            problem = f"different files: {', '.join(changed)}"
        if problem:
            failures += 1
            print(f"killed at {name} {k}: {problem}", flush=True)
    left = ", ".join(f"{state} {n}" for state, n in sorted(states.items()))
    print(f"system calls: {len(calls)}; killed: {killed}; left behind: {left}; failures: {failures}")
    # If no run was killed, nothing was tested.
    return 1 if failures or not killed else 0


if __name__ == "__main__":
    sys.exit(main())
