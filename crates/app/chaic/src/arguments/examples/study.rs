//! Examples of `chaic study`.

use super::CommandExamples;

pub(super) const EXAMPLES: &[CommandExamples] = &[
    (
        "chaic study",
        [
            ("Check a definition", "chaic study check study.toml"),
            ("Write its page", "chaic study build study.toml --out study.html"),
            ("Export the collected data", "chaic study export data --study study.toml --out set"),
        ],
    ),
    (
        "chaic study check",
        [
            ("Check a definition", "chaic study check study.toml"),
            (
                "Simulate 1,000 participants, of whom a fifth drop out",
                "chaic study check study.toml --participants 1000 --dropout 20",
            ),
            ("Print all as JSON", "chaic study check study.toml --format json"),
        ],
    ),
    (
        "chaic study build",
        [
            ("Write study.html", "chaic study build study.toml"),
            ("Write another file", "chaic study build study.toml --out shelves.html"),
            ("Print its digest as JSON", "chaic study build study.toml --format json"),
        ],
    ),
    (
        "chaic study serve",
        [
            ("Serve a study on this computer", "chaic study serve study.toml --data data"),
            (
                "Serve it behind a proxy with TLS",
                "chaic study serve study.toml --data data --host study.example.org",
            ),
            (
                "Serve it in the network of a laboratory",
                "chaic study serve study.toml --data data --listen 192.168.0.10:8040",
            ),
        ],
    ),
    (
        "chaic study export",
        [
            ("Export a folder", "chaic study export data --study study.toml --out set"),
            (
                "Write a LeRobot data set too",
                "chaic study export data --study study.toml --out set --lerobot",
            ),
            ("Verify an exported trace", "chaic verify set/traces/K7QXM2RBTA/trial-01.jsonl"),
        ],
    ),
    (
        "chaic study delete",
        [
            ("Delete from the collected files", "chaic study delete K7QXM2RBTA data"),
            ("Delete from an exported data set", "chaic study delete K7QXM2RBTA set"),
            ("Print what was deleted as JSON", "chaic study delete K7QXM2RBTA data --format json"),
        ],
    ),
];
