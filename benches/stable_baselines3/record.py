"""Records PPO updates of Stable-Baselines3, which a test of chaic-learn repeats.

    pip install stable-baselines3==2.9.2
    python3 benches/stable_baselines3/record.py crates/learn/chaic-learn/tests/fixtures/ppo_updates.json

A linear policy plays random episodes. Each case has the rollout buffer, the parameters before and
after the update, and the logged metrics. A minibatch holds all decisions, so no shuffle matters.
"""

import json
import sys

import gymnasium
import numpy as np
import stable_baselines3
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback

N_FEATURES, N_ACTIONS, N_STEPS = 5, 3, 96
COMMON = {"gamma": 0.9, "gae_lambda": 0.8, "n_epochs": 10, "learning_rate": 0.02}
CASES = [
    {**COMMON},
    {**COMMON, "ent_coef": 0.05, "vf_coef": 0.25, "clip_range": 0.1, "clip_range_vf": 0.3},
    {**COMMON, "n_epochs": 40, "target_kl": 0.01},
]


class RandomEpisodes(gymnasium.Env):
    """Random features; the reward depends on features and action."""

    observation_space = gymnasium.spaces.Box(-1.0, 1.0, (N_FEATURES,), np.float32)
    action_space = gymnasium.spaces.Discrete(N_ACTIONS)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.features = self.np_random.uniform(-1, 1, N_FEATURES).astype(np.float32)
        return self.features, {}

    def step(self, action):
        reward = float(self.features[int(action)] + 0.1 * self.np_random.normal())
        self.features = self.np_random.uniform(-1, 1, N_FEATURES).astype(np.float32)
        return self.features, reward, bool(self.np_random.random() < 0.1), False, {}


class Recorder(BaseCallback):
    """Copies the rollout buffer and the parameters before the update."""

    def _on_step(self):
        return True

    def _on_rollout_end(self):
        buffer = self.model.rollout_buffer
        self.last_value = float(self.locals["values"].item())
        self.last_done = bool(self.locals["dones"][0])
        names = ["observations", "actions", "rewards", "values", "log_probs", "advantages", "returns"]
        self.buffer = {name: getattr(buffer, name).reshape(-1).tolist() for name in names}
        self.episode_starts = buffer.episode_starts.reshape(-1).astype(bool).tolist()
        self.parameters = parameters(self.model)


def parameters(model):
    """Returns the parameters in the order of chaic: weights [inputs, outputs], then biases."""
    layers = [model.policy.action_net, model.policy.value_net]
    tensors = [t for layer in layers for t in (layer.weight.T, layer.bias)]
    return [float(x) for t in tensors for x in t.detach().reshape(-1)]


def record(settings, seed):
    torch.manual_seed(seed)
    policy = {"net_arch": [], "ortho_init": False}
    model = PPO(
        "MlpPolicy", RandomEpisodes(), n_steps=N_STEPS, batch_size=N_STEPS, policy_kwargs=policy,
        seed=seed, device="cpu", **settings,
    )
    recorder = Recorder()
    model.learn(N_STEPS, callback=recorder)
    logged = model.logger.name_to_value
    metrics = {
        "policy_loss": logged["train/policy_gradient_loss"],
        "value_loss": logged["train/value_loss"],
        "entropy": -logged["train/entropy_loss"],
        "approx_kl": logged["train/approx_kl"],
        "clip_fraction": logged["train/clip_fraction"],
        "explained_variance": logged["train/explained_variance"],
    }
    return {
        "settings": settings,
        **recorder.buffer,
        "episode_starts": recorder.episode_starts,
        "last_value": recorder.last_value,
        "last_done": recorder.last_done,
        "before": recorder.parameters,
        "after": parameters(model),
        "metrics": {name: float(value) for name, value in metrics.items()},
    }


def main(path):
    torch.set_num_threads(1)
    cases = [record(settings, seed) for seed, settings in enumerate(CASES)]
    content = {"stable_baselines3": stable_baselines3.__version__, "cases": cases}
    with open(path, "w") as file:
        json.dump(content, file, separators=(",", ":"))
        file.write("\n")


if __name__ == "__main__":
    main(sys.argv[1])
