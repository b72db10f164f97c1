"""PPO with TorchRL on plans: the policy chooses among the plans of chaic's planner, which executes them.

    pip install '.[gym]' torch torchrl
    python examples/python/ppo_torchrl.py --steps 20000
"""

from __future__ import annotations

import argparse
from typing import Any

import gymnasium
import numpy as np
import torch
from tensordict.nn import TensorDictModule, TensorDictSequential
from torch import nn
from torchrl.envs import GymWrapper
from torchrl.modules import MaskedCategorical, ProbabilisticActor, ValueOperator
from torchrl.objectives import ClipPPOLoss
from torchrl.objectives.value import GAE

import chaic

ROLLOUT, EPOCHS, MINIBATCH = 256, 4, 64


class Flat(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Flattens proprioception and plans into one vector, with the mask of the offered plans."""

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        super().__init__(env)
        n = int(env.action_space.n)  # type: ignore[attr-defined]
        shapes = [space.shape for space in env.observation_space.values()]  # type: ignore[attr-defined]
        size = sum(int(np.prod(shape)) for shape in shapes)
        self.observation_space = gymnasium.spaces.Dict(
            {
                "observation": gymnasium.spaces.Box(-np.inf, np.inf, (size,), np.float32),
                "action_mask": gymnasium.spaces.MultiBinary(n),
            }
        )

    def _flat(self, observation: dict[str, Any], info: dict[str, Any]) -> dict[str, Any]:
        parts = [np.asarray(part, np.float32).ravel() for part in observation.values()]
        mask = np.asarray(info["action_mask"], np.int8)
        # A finished episode offers no plan; an all-zero mask would be invalid.
        return {"observation": np.concatenate(parts), "action_mask": mask if mask.any() else mask + 1}

    def reset(self, **options: Any) -> tuple[Any, dict[str, Any]]:
        observation, info = self.env.reset(**options)
        return self._flat(observation, info), info

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        observation, reward, terminated, truncated, info = self.env.step(int(action))
        return self._flat(observation, info), float(reward), terminated, truncated, info


def network(inputs: int, outputs: int) -> nn.Module:
    """Returns an MLP with two hidden layers."""
    return nn.Sequential(nn.Linear(inputs, 128), nn.Tanh(), nn.Linear(128, 128), nn.Tanh(), nn.Linear(128, outputs))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--task", default="LowTarget")
    parser.add_argument("--steps", type=int, default=20_000, help="total number of plans")
    arguments = parser.parse_args()
    torch.manual_seed(0)
    flat = Flat(
        gymnasium.make(f"chaic/{arguments.task}-v0", observation="proprioception", action="plan", partner_image_size=128)
    )
    size = flat.observation_space["observation"].shape[0]  # type: ignore[index]
    n = int(flat.env.action_space.n)  # type: ignore[attr-defined]
    env = GymWrapper(flat, categorical_action_encoding=True)
    env.set_seed(0)
    logits_and_mask = TensorDictSequential(
        TensorDictModule(network(size, n), in_keys=["observation"], out_keys=["logits"]),
        TensorDictModule(lambda mask: mask.bool(), in_keys=["action_mask"], out_keys=["mask"]),
    )
    actor = ProbabilisticActor(
        logits_and_mask,
        in_keys=["logits", "mask"],
        spec=env.action_spec,
        distribution_class=MaskedCategorical,
        return_log_prob=True,
    )
    value = ValueOperator(network(size, 1), in_keys=["observation"])
    advantage = GAE(gamma=0.99, lmbda=0.95, value_network=value)
    loss = ClipPPOLoss(actor, value, clip_epsilon=0.2, entropy_coeff=0.01)
    optimizer = torch.optim.Adam(loss.parameters(), lr=3e-4)
    taken = 0
    while taken < arguments.steps:
        with torch.no_grad():
            played = env.rollout(min(ROLLOUT, arguments.steps - taken), actor, break_when_any_done=False)
            advantage(played)
        taken += played.numel()
        for _ in range(EPOCHS):
            for batch in played[torch.randperm(played.numel())].split(MINIBATCH):
                losses = loss(batch)
                optimizer.zero_grad()
                sum(losses[key] for key in losses.keys() if key.startswith("loss_")).backward()
                nn.utils.clip_grad_norm_(loss.parameters(), 0.5)
                optimizer.step()
        reward = played["next", "reward"].mean().item()
        print(f"{taken} plans, mean reward {reward:.4f}", flush=True)
    print(f"chaic {chaic.__version__}: trained on {taken} plans")


if __name__ == "__main__":
    main()
