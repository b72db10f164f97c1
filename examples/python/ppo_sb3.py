"""PPO with Stable-Baselines3, as in the paper, on one task.

    pip install '.[rl]'
    python examples/python/ppo_sb3.py --task high_target --steps 20000 --out ppo.zip
"""

from __future__ import annotations

import argparse
from typing import Any

import gymnasium
import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy

import chaic
from chaic.registry import IDS


class Learnable(gymnasium.ObservationWrapper[Any, Any, Any]):
    """Converts depth to a gray image, which the networks of Stable-Baselines3 accept."""

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        super().__init__(env)
        spaces = dict(env.observation_space.spaces)  # type: ignore[attr-defined]
        size = spaces["rgb"].shape[0]
        spaces["depth"] = gymnasium.spaces.Box(0, 255, (size, size, 1), np.uint8)
        self.observation_space = gymnasium.spaces.Dict(spaces)

    def observation(self, observation: Any) -> Any:
        """Scales depth from 0 to 10 m to a byte."""
        depth = np.clip(observation["depth"] * 25.5, 0, 255).astype(np.uint8)
        return observation | {"depth": depth[..., None]}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--task", default="high_target", choices=chaic.tasks())
    parser.add_argument("--steps", type=int, default=20_000)
    parser.add_argument("--envs", type=int, default=8)
    parser.add_argument("--out", default="ppo.zip")
    arguments = parser.parse_args()
    options = {"image_size": 64, "partner_image_size": 128}
    envs = make_vec_env(
        IDS[arguments.task],
        n_envs=arguments.envs,
        seed=0,
        env_kwargs=options,
        wrapper_class=Learnable,
    )
    rollout = max(8, min(128, arguments.steps // arguments.envs))
    model = PPO("MultiInputPolicy", envs, n_steps=rollout, batch_size=64, verbose=1, seed=0)
    model.learn(arguments.steps)
    model.save(arguments.out)
    reward, spread = evaluate_policy(model, envs, n_eval_episodes=2)
    print(f"return of two training episodes: {reward:.2f}, standard deviation {spread:.2f}")


if __name__ == "__main__":
    main()
