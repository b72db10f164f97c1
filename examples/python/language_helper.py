"""A helper that asks a language model which plan to follow, at any endpoint that speaks OpenAI's protocol.

    OPENAI_API_KEY=... python examples/python/language_helper.py --endpoint http://localhost:8080/v1 --model NAME

chaic has language helpers of its own, with prompts, budgets and records (docs/language-helpers.md); this one is a
beginning for those who want another.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import urllib.request
from typing import Any

import chaic

PROMPT = """You help somebody who carries things to a goal, and see only what you have seen so far.
You remember: {things}.
What do you do next? Answer with the number of one of these plans.
{plans}"""


class LanguageHelper:
    """Chooses plans by asking; chaic's planner perceives, remembers and carries them out."""

    endpoint = ""
    model = ""
    images = ("depth", "ids")
    grants = tuple(chaic.Planner().grants)

    def __init__(self) -> None:
        self.planner = chaic.Planner()

    def reset(self, briefing: chaic.Briefing) -> None:
        """Begins an episode."""
        self.planner.reset(briefing)

    def act(self, observation: chaic.Observation) -> Any:
        """The next action of the plan that is followed, asking for another one when it has come to an end."""
        action = self.planner.attend(observation)
        while action is None:
            action = self.planner.choose(self.ask(self.planner.plans()))
        return action

    def ask(self, plans: list[str]) -> int:
        """Which plan the model names; the first if it names none."""
        seen = sorted({thing["class"] for thing in self.planner.things() if thing["is_present"]})
        numbered = "\n".join(f"{k}: {plan}" for k, plan in enumerate(plans))
        prompt = PROMPT.format(things=", ".join(seen) or "nothing", plans=numbered)
        body = {"model": self.model, "messages": [{"role": "user", "content": prompt}], "temperature": 0}
        request = urllib.request.Request(
            f"{self.endpoint}/chat/completions",
            json.dumps(body).encode(),
            {
                "Content-Type": "application/json",
                "Authorization": f"Bearer {os.environ.get('OPENAI_API_KEY', '')}",
            },
        )
        with urllib.request.urlopen(request, timeout=60) as response:
            answer = json.load(response)["choices"][0]["message"]["content"]
        numbers = [int(n) for n in re.findall(r"\d+", answer)]
        return next((n for n in numbers if n < len(plans)), 0)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--endpoint", required=True)
    parser.add_argument("--model", required=True)
    parser.add_argument("--task", default="low_target")
    parser.add_argument("--out", default="runs/language")
    arguments = parser.parse_args()
    LanguageHelper.endpoint, LanguageHelper.model = arguments.endpoint, arguments.model
    chaic.evaluate(
        LanguageHelper, tasks=arguments.task, split="train", first=1, out=arguments.out, jobs=4
    )


if __name__ == "__main__":
    main()
