"""Environment ids for Gymnasium: one for each task, and one for all tasks of the paper."""

from __future__ import annotations

#: Environment ids by task.
IDS = {
    "no_constraint": "chaic/NoConstraint-v0",
    "high_target": "chaic/HighTarget-v0",
    "high_container": "chaic/HighContainer-v0",
    "high_goal": "chaic/HighGoal-v0",
    "low_target": "chaic/LowTarget-v0",
    "obstacle": "chaic/Obstacle-v0",
    "shopping": "chaic/Shopping-v0",
    "moving_house": "chaic/MovingHouse-v0",
    "one_handed": "chaic/OneHanded-v0",
    "low_vision": "chaic/LowVision-v0",
    "tires": "chaic/Tires-v0",
    "tremor": "chaic/Tremor-v0",
}

#: Environment id for the paper's eight tasks.
ALL = "chaic/All-v0"


def register() -> None:
    """Registers the ids if Gymnasium is installed; ``import chaic`` calls this."""
    try:
        import gymnasium
    except ImportError:
        return
    for task, name in [*IDS.items(), (None, ALL)]:
        if name not in gymnasium.registry:
            gymnasium.register(
                name,
                entry_point="chaic.gym:HelperEnv",
                vector_entry_point="chaic.vector:HelperVectorEnv",
                kwargs={"task": task},
            )
