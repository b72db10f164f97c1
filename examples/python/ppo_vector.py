"""PPO in one file (after CleanRL, Huang et al. 2022) on the vector environment: proprioception only, all eight tasks.

    pip install '.[gym]' torch
    python examples/python/ppo_vector.py --steps 200000
"""

from __future__ import annotations

import argparse
import time

import gymnasium
import numpy as np
import torch
from torch import nn
from torch.distributions import Categorical

import chaic

ENVS, ROLLOUT, EPOCHS, MINIBATCHES = 64, 32, 4, 4
GAMMA_PER_FRAME, LAMBDA, CLIP, ENTROPY = 0.9995, 0.95, 0.2, 0.01


class Policy(nn.Module):
    """Chooses a kind of action and one of eight by eight image cells as its target."""

    def __init__(self, inputs: int, kinds: int, cells: int) -> None:
        super().__init__()
        self.body = nn.Sequential(nn.Linear(inputs, 128), nn.Tanh(), nn.Linear(128, 128), nn.Tanh())
        self.heads = nn.ModuleList([nn.Linear(128, n) for n in (kinds, cells, cells)])
        self.value = nn.Linear(128, 1)

    def forward(
        self, own: torch.Tensor, mask: torch.Tensor
    ) -> tuple[list[Categorical], torch.Tensor]:
        """Returns the distributions of kind, column and row, and the value."""
        hidden = self.body(own)
        kinds, columns, rows = (head(hidden) for head in self.heads)
        kinds = kinds.masked_fill(~mask, -1e9)
        return [Categorical(logits=x) for x in (kinds, columns, rows)], self.value(hidden)[:, 0]


def log_prob(heads: list[Categorical], actions: torch.Tensor) -> torch.Tensor:
    """Returns the log-probability of complete actions, shape [n, 3]."""
    return torch.stack([h.log_prob(a) for h, a in zip(heads, actions.T, strict=True)]).sum(0)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=200_000, help="total number of decisions")
    arguments = parser.parse_args()
    torch.manual_seed(0)
    size, cells = 64, 8
    envs = gymnasium.make_vec(
        "chaic/All-v0",
        num_envs=ENVS,
        vectorization_mode="vector_entry_point",
        observation="proprioception",
        image_size=size,
        partner_image_size=128,
        autoreset_mode="SameStep",
        copy=True,
    )
    policy = Policy(len(chaic.PROPRIOCEPTION), len(chaic.ACTIONS), cells)
    optimizer = torch.optim.Adam(policy.parameters(), 3e-4, eps=1e-5)
    observation, infos = envs.reset(seed=0)
    began, decisions, scores = time.perf_counter(), 0, [0.0]
    while decisions < arguments.steps:
        batch: dict[str, list[torch.Tensor]] = {
            name: [] for name in ("proprioception", "mask", "action", "log_prob", "value", "reward", "discount")
        }
        for _ in range(ROLLOUT):
            own = torch.from_numpy(observation["proprioception"])
            mask = torch.from_numpy(infos["kind_mask"]).bool()
            with torch.no_grad():
                heads, value = policy(own, mask)
                action = torch.stack([head.sample() for head in heads], 1)
            rows = action.numpy().copy()
            rows[:, 1:] = rows[:, 1:] * size // cells + size // cells // 2
            observation, reward, terminated, truncated, infos = envs.step(rows)
            ended = terminated | truncated
            if ended.any():
                scores += infos["final_info"]["tr"][ended].tolist()
            # Decisions differ in duration, so the discount is per frame.
            discount = np.where(ended, 0.0, GAMMA_PER_FRAME ** infos["frames"])
            for name, values in [
                ("proprioception", own),
                ("mask", mask),
                ("action", action),
                ("log_prob", log_prob(heads, action)),
                ("value", value),
                ("reward", torch.from_numpy(reward).float()),
                ("discount", torch.from_numpy(discount).float()),
            ]:
                batch[name].append(values)
            decisions += ENVS
        with torch.no_grad():
            own = torch.from_numpy(observation["proprioception"])
            _, value = policy(own, torch.from_numpy(infos["kind_mask"]).bool())
        advantages, advantage = [], torch.zeros(ENVS)
        for k in reversed(range(ROLLOUT)):
            delta = batch["reward"][k] + batch["discount"][k] * value - batch["value"][k]
            advantage = delta + batch["discount"][k] * LAMBDA * advantage
            advantages.insert(0, advantage)
            value = batch["value"][k]
        data = {name: torch.cat(values) for name, values in batch.items()}
        gained = torch.cat(advantages)
        returns = gained + data["value"]
        for _ in range(EPOCHS):
            for part in torch.randperm(len(gained)).chunk(MINIBATCHES):
                heads, value = policy(data["proprioception"][part], data["mask"][part])
                ratio = (log_prob(heads, data["action"][part]) - data["log_prob"][part]).exp()
                a = gained[part]
                a = (a - a.mean()) / (a.std() + 1e-8)
                gain = torch.min(ratio * a, ratio.clamp(1 - CLIP, 1 + CLIP) * a).mean()
                entropy = torch.stack([head.entropy() for head in heads]).sum(0).mean()
                loss = -gain + 0.5 * ((value - returns[part]) ** 2).mean() - ENTROPY * entropy
                optimizer.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(policy.parameters(), 0.5)
                optimizer.step()
        rate = decisions / (time.perf_counter() - began)
        reward = data["reward"].mean()
        print(f"{decisions} decisions, {rate:.0f}/s, reward {reward:.4f}, TR {np.mean(scores[-100:]):.3f}")


if __name__ == "__main__":
    main()
