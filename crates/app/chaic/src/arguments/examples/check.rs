//! Examples of the commands that check and measure, and of those for the shell.

use super::CommandExamples;

pub(super) const EXAMPLES: &[CommandExamples] = &[
    (
        "chaic verify",
        [
            ("Verify a run", "chaic verify runs/quick"),
            ("Verify the trace of a game in a browser", "chaic verify trace.jsonl"),
            ("Print the findings as JSON", "chaic verify runs/quick --format json"),
        ],
    ),
    (
        "chaic fidelity",
        [
            ("Compare both rule sets", "chaic fidelity --episodes original --out runs/fidelity"),
            (
                "Try one rule on few episodes",
                "chaic fidelity --episodes original --n-episodes 2 --switch world.blocking --out runs/try",
            ),
            (
                "Write the document again",
                "chaic fidelity --only-document --out runs/fidelity --doc fidelity.md",
            ),
        ],
    ),
    (
        "chaic bench",
        [
            ("Measure the renderer", "chaic bench render"),
            ("Measure the simulator", "chaic bench world --task obstacle"),
            ("Measure many environments", "chaic bench env --envs 64 --threads 8"),
        ],
    ),
    (
        "chaic bench render",
        [
            ("Measure the default scene", "chaic bench render"),
            (
                "Measure an episode with small images",
                "chaic bench render --episode shopping/test/00 --size 128",
            ),
            ("Print JSON", "chaic bench render --threads 8 --format json"),
        ],
    ),
    (
        "chaic bench world",
        [
            ("Measure all tasks", "chaic bench world"),
            ("Measure two tasks", "chaic bench world --task obstacle,shopping"),
            ("Print JSON", "chaic bench world --seconds 1 --format json"),
        ],
    ),
    (
        "chaic bench env",
        [
            ("Measure 64 environments", "chaic bench env"),
            ("Use eight threads", "chaic bench env --envs 256 --threads 8"),
            ("Measure without images of helpers", "chaic bench env --channels none"),
        ],
    ),
    (
        "chaic bench scaling",
        [
            ("Measure 64 environments", "chaic bench scaling"),
            (
                "Estimate a cluster of larger machines",
                "chaic bench scaling --cores-per-node 64 --network 100000 --learner-rate 50000",
            ),
            ("Measure without images of helpers", "chaic bench scaling --channels none"),
        ],
    ),
    (
        "chaic bench scene",
        [
            ("Write the default scene", "chaic bench scene --out scene"),
            ("Write a smaller one", "chaic bench scene --objects 20 --out scene"),
            ("Write an episode", "chaic bench scene --episode shopping/test/00 --out scene"),
        ],
    ),
    (
        "chaic doctor",
        [
            ("Check this machine", "chaic doctor"),
            ("Print the checks as JSON", "chaic doctor --format json"),
            ("Print them without colors", "chaic doctor --color never"),
        ],
    ),
    (
        "chaic completions",
        [
            ("Print the script for bash", "chaic completions bash"),
            ("Print the script for zsh", "chaic completions zsh"),
            ("Print the script for fish", "chaic completions fish"),
        ],
    ),
    (
        "chaic man",
        [
            ("Write the pages into a folder", "chaic man man1"),
            ("Write them for your user", "chaic man ~/.local/share/man/man1"),
            ("List the written pages as JSON", "chaic man man1 --format json"),
        ],
    ),
];
