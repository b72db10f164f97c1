"""A helper that asks a language model which plan to execute, at any OpenAI-compatible endpoint.

    OPENAI_API_KEY=... python examples/python/language_helper.py --endpoint http://localhost:8080/v1 --model NAME

chaic has language helpers with prompts, budgets and records (docs/language-helpers.md); this one is a minimal starting
point.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import urllib.request
from typing import Any

import chaic

PROMPT = """You help a person who carries objects to a goal. You know only what you have seen.
You remember: {objects}.
What do you do next? Answer with the number of one of these plans.
{plans}"""


class LanguageHelper:
    """Asks a model for each plan; chaic's planner perceives, remembers and executes."""

    endpoint = ""
    model = ""
    images = ("depth", "ids")
    grants = tuple(chaic.Planner().grants)

    def __init__(self) -> None:
        self.planner = chaic.Planner()

    def reset(self, briefing: chaic.Briefing) -> None:
        """Starts an episode."""
        self.planner.reset(briefing)

    def act(self, observation: chaic.Observation) -> Any:
        """Returns the next action; asks for a new plan when the current one has ended."""
        action = self.planner.act(observation)
        while action is None:
            action = self.planner.choose(self.ask(self.planner.plans()))
        return action

    def ask(self, plans: list[str]) -> int:
        """Returns the index of the model's plan, or 0 if its answer has no valid number."""
        remembered = {thing["class"] for thing in self.planner.remembered_objects() if thing["is_present"]}
        numbered = "\n".join(f"{k}: {plan}" for k, plan in enumerate(plans))
        prompt = PROMPT.format(objects=", ".join(sorted(remembered)) or "nothing", plans=numbered)
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
        LanguageHelper, tasks=arguments.task, split="train", n_episodes=1, out=arguments.out, jobs=4
    )


if __name__ == "__main__":
    main()
