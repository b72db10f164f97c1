//! Examples of the commands that collect data and train.

use super::CommandExamples;

pub(super) const EXAMPLES: &[CommandExamples] = &[
    (
        "chaic collect",
        [
            ("Collect labeled images", "chaic collect detection --out data/detection"),
            ("Collect labeled clips", "chaic collect behavior --out data/behavior"),
            (
                "Collect observations of partners",
                "chaic collect opponent --out data/opponent.safetensors",
            ),
        ],
    ),
    (
        "chaic collect detection",
        [
            ("Collect 1000 images", "chaic collect detection --out data/detection"),
            (
                "Collect validation images",
                "chaic collect detection --split validation --views 200 --out data/validation",
            ),
            (
                "Collect images in the benchmark's appearance",
                "chaic collect detection --scenes natural --appearance canonical --out data/natural",
            ),
        ],
    ),
    (
        "chaic collect behavior",
        [
            ("Collect clips", "chaic collect behavior --out data/behavior"),
            (
                "Collect validation clips",
                "chaic collect behavior --split validation --max-per-class 20 --out data/validation",
            ),
            (
                "Use ground truth for the person's position",
                "chaic collect behavior --perception gt --out data/behavior",
            ),
        ],
    ),
    (
        "chaic collect opponent",
        [
            ("Collect windows", "chaic collect opponent --out data/opponent.safetensors"),
            (
                "Collect validation windows",
                "chaic collect opponent --split validation --out data/validation.safetensors",
            ),
            (
                "Collect a few from one episode",
                "chaic collect opponent --max-per-class 20 --n-episodes 1 --out data/few.safetensors",
            ),
        ],
    ),
    (
        "chaic train",
        [
            ("Train the detector", "chaic train detection --out runs/detection"),
            ("Train a policy", "chaic train ppo --out runs/ppo"),
            ("Continue a training", "chaic train ppo --resume --out runs/ppo"),
        ],
    ),
    (
        "chaic train detection",
        [
            ("Train with the default configuration", "chaic train detection --out runs/detection"),
            (
                "Train for fewer steps",
                "chaic train detection --steps 1000 --set second_stage.steps=500 --out runs/short",
            ),
            ("Continue a training", "chaic train detection --resume --out runs/detection"),
        ],
    ),
    (
        "chaic train behavior",
        [
            ("Train with the default configuration", "chaic train behavior --out runs/behavior"),
            (
                "Train with a configuration",
                "chaic train behavior --config behavior.toml --out runs/behavior",
            ),
            ("Continue a training", "chaic train behavior --resume --out runs/behavior"),
        ],
    ),
    (
        "chaic train ppo",
        [
            ("Train with the default configuration", "chaic train ppo --out runs/ppo"),
            (
                "Start from a cloned policy",
                "chaic train ppo --weights runs/clone/policy.safetensors --out runs/ppo",
            ),
            ("Continue a training", "chaic train ppo --resume --out runs/ppo"),
        ],
    ),
    (
        "chaic train clone",
        [
            ("Train with the default configuration", "chaic train clone --out runs/clone"),
            (
                "Train with a configuration",
                "chaic train clone --config clone.toml --out runs/clone",
            ),
            ("Continue a training", "chaic train clone --resume --out runs/clone"),
        ],
    ),
    (
        "chaic train visual",
        [
            ("Train with the default configuration", "chaic train visual --out runs/visual"),
            (
                "Train for another task",
                "chaic train visual --set 'tasks=[\"obstacle\"]' --out runs/obstacle",
            ),
            ("Continue a training", "chaic train visual --resume --out runs/visual"),
        ],
    ),
    (
        "chaic train partner",
        [
            ("Imitate partners with drawn habits", "chaic train partner --out runs/partner"),
            (
                "Imitate recorded people",
                "chaic train partner --set 'recordings=\"data/traces\"' --out runs/people",
            ),
            ("Continue a training", "chaic train partner --resume --out runs/partner"),
        ],
    ),
    (
        "chaic train opponent",
        [
            ("Train with the default configuration", "chaic train opponent --out runs/opponent"),
            (
                "Train with a configuration",
                "chaic train opponent --config opponent.toml --out runs/opponent",
            ),
            ("Continue a training", "chaic train opponent --resume --out runs/opponent"),
        ],
    ),
    (
        "chaic export",
        [
            ("Export all episodes", "chaic export lerobot runs/quick --out data/quick"),
            ("Export one helper", "chaic export lerobot runs/quick --helper rhp --out data/rhp"),
            (
                "Export the partner's view",
                "chaic export lerobot runs/quick --agent partner --out data/partner",
            ),
        ],
    ),
    (
        "chaic export lerobot",
        [
            ("Export all episodes", "chaic export lerobot runs/quick --out data/quick"),
            (
                "Export one helper in one task",
                "chaic export lerobot runs/quick --helper rhp --task obstacle --out data/rhp",
            ),
            (
                "Export 10 samples per second with small images",
                "chaic export lerobot runs/quick --every 3 --size 128 --out data/small",
            ),
        ],
    ),
    (
        "chaic export episodes",
        [
            (
                "Export the standard split",
                "chaic export episodes --split standard --out data/standard",
            ),
            (
                "Export episodes of a task for training",
                "chaic export episodes --split gen:0..100 --task shopping --out data/shopping",
            ),
            (
                "Export the episodes of an opened contest",
                "chaic export episodes --episodes opened --out data/contest",
            ),
        ],
    ),
];
