#!/usr/bin/env python3
"""Writes docs/reference/language-prompts.md: prompts of all tasks, of `llm_known_task` and of a partner, and a record.

Plays the first test episode of each task with the stand-in for a language model and takes the
longest prompt of each run, which has the longest history.

usage: benches/prompts/run.py [--out DIR]

Environment:
  BIN   folder of built programs (default: built by cargo build --release)
"""

import argparse
import pathlib
import re
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from programs import ROOT, programs, remove_run, serving  # noqa: E402

PAGE = ROOT / "docs/reference/language-prompts.md"
TITLES = {
    "no_constraint": "No constraint",
    "high_target": "High target",
    "high_container": "High container",
    "high_goal": "High goal",
    "low_target": "Low target",
    "obstacle": "Obstacle",
    "shopping": "Shopping",
    "moving_house": "Moving house",
}
HEAD = """# Prompts and a transcript

One prompt of each task with `--helper llm`, one with `--helper llm_known_task`, one for a partner, and a record of an episode.
**The answers are a scripted stand-in's, not a language model's**: they show only the form. `benches/prompts/run.py`
writes this page. By hand:

```sh
cargo run -p chaic-llm-standin &
chaic eval --n-episodes 1 --helper llm,llm_known_task --endpoint http://127.0.0.1:8808/v1 --model standin --out runs/prompts
chaic eval --task low_target --n-episodes 1 --helper none --partner llm \\
    --endpoint http://127.0.0.1:8808/v1 --model standin --out runs/partner
chaic llm show runs/prompts high_target/test/00        # and so on
```

`vlm` gets the same text, the sentence of `images.txt` and images.
"""


def longest_question(shown):
    """Returns frame, prompt and answer of the longest prompt in the output of `chaic llm show`."""
    asked = re.compile(
        r"^=== frame (\d+): asked.*?\n--- to the model\n(.*?)\n--- answer .*?\n(.*?)\n>>>", re.M | re.S
    )
    return max(asked.findall(shown), key=lambda question: len(question[1]))


def section(title, shown):
    frame, prompt, answer = longest_question(shown)
    return f"""
## {title}, frame {frame}

```text
{prompt}
```

Answer of the stand-in: `{answer}`
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "target/prompts")
    out = parser.parse_args().out
    chaic, standin = programs()

    def show(run, task, *options):
        command = [chaic, "llm", "show", out / run, f"{task}/test/00", *options]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout

    with serving(standin) as address:
        model = ["--endpoint", address, "--model", "standin"]
        for run, options in {
            "helpers": ["--helper", "llm,llm_known_task"],
            "partner": ["--task", "low_target", "--helper", "none", "--partner", "llm"],
        }.items():
            remove_run(out / run)
            command = [chaic, "eval", "--n-episodes", "1", *options, *model, "--out", out / run]
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    page = [HEAD]
    for task, title in TITLES.items():
        page.append(section(title, show("helpers", task, "--helper", "llm")))
    page.append(section("Obstacle, known task", show("helpers", "obstacle", "--helper", "llm_known_task")))
    page.append(section("A partner, low target", show("partner", "low_target", "--agent", "partner")))
    record = show("helpers", "moving_house", "--helper", "llm", "--brief")
    page.append(f"""
## A record: moving house

`chaic llm show runs/prompts moving_house/test/00 --helper llm --brief`; the stand-in decides.

```text
{record.rstrip()}
```
""")
    PAGE.write_text("".join(page))
    print(f"wrote {PAGE}")


if __name__ == "__main__":
    main()
