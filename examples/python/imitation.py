"""Imitation learning: exports decisions of the oracle, and trains a network to predict the kind of its actions.

    pip install '.[gym]' torch
    python examples/python/imitation.py --episodes 4 --out runs/imitation
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import nn

import chaic

SIZE = 64


def kind_of(action: Any) -> int:
    """Returns the index of an action in ``chaic.ACTIONS``."""
    if isinstance(action, str):
        return chaic.ACTIONS.index(action)
    ((name, fields),) = action.items()
    hand = fields.get("hand") if isinstance(fields, dict) else None
    return chaic.ACTIONS.index(name if hand is None else f"{name}_{hand}")


def export(name: str, path: Path) -> None:
    """Plays an episode with the oracle and writes its downsampled depth, its proprioception and its actions."""
    oracle = chaic.PlanningAgent("oracle")
    world = chaic.World(
        chaic.Episode(name), images=["rgb", "depth", "ids"], image_size=512, grants=oracle.grants
    )
    oracle.reset(world.briefing())
    depth, proprioception, kinds = [], [], []
    while world.advance() == "needs_action":
        observation = world.observe()
        action = oracle.act(observation)
        assert observation.depth is not None
        step = 512 // SIZE
        depth.append(observation.depth[step // 2 :: step, step // 2 :: step].astype(np.float16))
        proprioception.append(world.proprioception()[0])
        kinds.append(kind_of(action))
        world.submit(action)
    np.savez_compressed(path, depth=depth, proprioception=proprioception, kind=kinds)


class Imitator(nn.Module):
    """Predicts the kind of action from depth and proprioception."""

    def __init__(self) -> None:
        super().__init__()
        self.encoder = nn.Sequential(
            nn.Conv2d(1, 16, 5, 2), nn.ReLU(), nn.Conv2d(16, 32, 3, 2), nn.ReLU(),
            nn.Conv2d(32, 32, 3, 2), nn.ReLU(), nn.Flatten(), nn.LazyLinear(64), nn.ReLU(),
        )
        self.head = nn.Linear(64 + len(chaic.PROPRIOCEPTION), len(chaic.ACTIONS))

    def forward(self, depth: torch.Tensor, proprioception: torch.Tensor) -> torch.Tensor:
        """Returns a logit for each kind."""
        features = self.encoder(depth[:, None].clamp(0, 10) / 10)
        return self.head(torch.cat([features, proprioception], 1))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--episodes", type=int, default=4)
    parser.add_argument("--epochs", type=int, default=10)
    parser.add_argument("--out", type=Path, default=Path("runs/imitation"))
    arguments = parser.parse_args()
    if arguments.episodes < 2:
        parser.error("--episodes is at least 2: the last episode is for the test")
    arguments.out.mkdir(parents=True, exist_ok=True)
    torch.manual_seed(0)
    names = chaic.episode_ids("train", "no_constraint")[: arguments.episodes]
    files = [arguments.out / f"{k}.npz" for k in range(len(names))]
    for name, path in zip(names, files, strict=True):
        if not path.exists():
            export(name, path)
    played = [np.load(path) for path in files]
    depth, proprioception, kind = (
        torch.from_numpy(np.concatenate([p[part] for p in played])) for part in ("depth", "proprioception", "kind")
    )
    print(f"{len(kind)} decisions of {len(names)} episodes")
    model, n = Imitator(), len(kind)
    held_out = torch.arange(n) >= n - len(played[-1]["kind"])
    model(depth[:1].float(), proprioception[:1])
    optimizer = torch.optim.Adam(model.parameters(), 1e-3)
    for epoch in range(arguments.epochs):
        for part in torch.randperm(int((~held_out).sum())).split(64):
            loss = nn.functional.cross_entropy(model(depth[part].float(), proprioception[part]), kind[part])
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
        with torch.no_grad():
            predicted = model(depth[held_out].float(), proprioception[held_out]).argmax(1)
            accuracy = (predicted == kind[held_out]).float().mean()
            baseline = (kind[held_out] == kind[~held_out].mode().values).float().mean()
        print(f"epoch {epoch + 1}: accuracy {accuracy:.3f} on the last episode (most frequent kind: {baseline:.3f})")
    torch.save(model.state_dict(), arguments.out / "imitator.pt")


if __name__ == "__main__":
    main()
