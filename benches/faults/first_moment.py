#!/usr/bin/env python3
"""Kills a run at every system call of its first moment, and plays it again.

A first run is traced: its main thread's system calls from the first that names the run's folder
to the end, or to the first --seconds of it. For each of them another run is killed as it enters the
call. Then the run is resumed if its folder is a run, and else begun again by the same command. At
the end all files must be those of a run that nobody disturbed, byte by byte (but for the order of lines in
`results.jsonl`). Prints a line for each
failure and the counts, and exits with 1 if there was a failure.

usage: benches/faults/first_moment.py [--out DIR] [--seconds 1] [--every 1] [--model]

--model plays a helper that asks the stand-in for a language model, which adds settings and templates
to what a beginning writes. Needs Linux and strace (Debian: apt-get install strace).

Environment:
  BIN   folder of built programs (usual: built by cargo build --release)
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

# Enough for some decisions of everybody, and no more.
FRAMES = 40
TASKS = ("no_constraint", "shopping")
CALL = re.compile(r"^(\d+) +(\d+\.\d+) (\w+)\(")


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "target/first_moment")
    parser.add_argument("--seconds", type=float, default=1.0, help="of the traced run")
    parser.add_argument("--every", type=int, default=1, help="kill at every N-th call only")
    parser.add_argument("--model", action="store_true", help="with a language helper")
    return parser.parse_args()


def short_episodes(chaic, folder):
    for task in TASKS:
        generate = [chaic, "episodes", "generate", "--task", task, "--seeds", "0..1"]
        subprocess.run([*generate, "--out", folder], check=True, stdout=subprocess.DEVNULL)
    for path in folder.glob("*.json"):
        episode = json.loads(path.read_text())
        episode["setup"]["horizon"] = FRAMES
        path.write_text(json.dumps(episode))


def calls_of(log, folder, seconds):
    """The main thread's calls as (name, how many of this name so far), from the first that names
    the folder on."""
    counts, calls, main, begin = collections.Counter(), [], None, None
    for line in log.read_text(errors="replace").splitlines():
        if not (match := CALL.match(line)):
            continue
        thread, time, name = match[1], float(match[2]), match[3]
        main = main or thread
        if thread != main:
            continue
        counts[name] += 1
        if begin is None and f'{folder.name}' in line and name != "execve":
            begin = time
        if begin is not None and time - begin <= seconds:
            calls.append((name, counts[name]))
    return calls


def files(folder):
    """All that a run leaves, but the lock and what the language model was asked. Results stand in the
    order of their ending, which is nobody's promise, so their lines are sorted."""
    paths = (p for p in folder.rglob("*") if p.is_file() and p.name != ".lock")
    found = {str(p.relative_to(folder)): p.read_bytes() for p in paths}
    if results := found.get("results.jsonl"):
        found["results.jsonl"] = b"".join(sorted(results.splitlines(keepends=True)))
    is_asked = re.compile(r"llm/(?!settings|templates)").match
    return {name: data for name, data in found.items() if not is_asked(name)}


def differences(a, b):
    return sorted(name for name in a.keys() | b.keys() if a.get(name) != b.get(name))


def run(command):
    return subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL)


def again(chaic, begin, asked, folder):
    """Plays what was killed to its end; gives what is wrong, if anything is."""
    is_run = (folder / "run.json").exists()
    resume = [chaic, "eval", "--resume", *asked, "--out", folder]
    command = resume if is_run else begin
    ended = run(command)
    if ended.returncode != 0:
        how = "resumed" if is_run else "begun again"
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


def kill_everywhere(args, chaic, asked):
    folder = args.out / "run"
    helper = "llm" if asked else "none"
    eval_ = [chaic, "eval", "--episodes", args.out / "episodes", "--helper", helper, "--jobs", "1"]
    begin = [*eval_, "--size", "16", *asked, "--out", folder]
    log = args.out / "calls.log"
    traced = run(["strace", "-f", "-ttt", "-o", log, *begin])
    if traced.returncode != 0:
        sys.exit(f"the first run fails: {traced.stderr}")
    expected = files(folder)
    calls = calls_of(log, folder, args.seconds)[:: args.every]
    failures, killed, states = 0, 0, collections.Counter()
    for name, k in calls:
        shutil.rmtree(folder, ignore_errors=True)
        kill = f"inject={name}:signal=KILL:when={k}"
        ended = run(["strace", "-f", "-o", "/dev/null", "-e", kill, *begin])
        killed += ended.returncode in (-9, 137)
        state = "nothing" if not folder.exists() else "before run.json"
        states["run.json" if (folder / "run.json").exists() else state] += 1
        problem = again(chaic, begin, asked, folder)
        if not problem and (changed := differences(files(folder), expected)):
            problem = f"not the same: {', '.join(changed)}"
        if problem:
            failures += 1
            print(f"killed at {name} {k}: {problem}", flush=True)
    left = ", ".join(f"{state} {n}" for state, n in sorted(states.items()))
    print(f"system calls: {len(calls)}; killed: {killed}; left behind: {left}; failures: {failures}")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
