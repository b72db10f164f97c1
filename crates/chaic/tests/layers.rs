//! Promise: no crate reaches past the arrows of ARCHITECTURE.md; agents above all can't see
//! the world or its pictures. And the README's command knows which program is meant.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// Each crate with the crates of this workspace that it may depend on, tests included.
const ALLOWED: &[(&str, &[&str])] = &[
    ("chaic-protocol", &[]),
    ("chaic-world", &["chaic-protocol"]),
    ("chaic-episodes", &["chaic-protocol", "chaic-world"]),
    // Only its example draws episodes.
    ("chaic-render", &["chaic-protocol", "chaic-world", "chaic-episodes"]),
    // Only its tests and its bench need episodes. Nobody depends on it: its pictures aren't exact.
    ("chaic-render-gpu", &["chaic-protocol", "chaic-world", "chaic-episodes", "chaic-render"]),
    ("chaic-agents", &["chaic-protocol"]),
    // Built for every processor: nothing that needs more than Rust.
    ("chaic-goldens", &["chaic-protocol", "chaic-world", "chaic-episodes", "chaic-render"]),
    (
        "chaic-eval",
        &["chaic-protocol", "chaic-world", "chaic-episodes", "chaic-render", "chaic-agents"],
    ),
    // The stand-in knows nothing of chaic; only tests need it.
    ("chaic-llm-standin", &[]),
    (
        "chaic-llm",
        &["chaic-protocol", "chaic-episodes", "chaic-agents", "chaic-eval", "chaic-llm-standin"],
    ),
    // Only its example draws.
    ("chaic-import", &["chaic-protocol", "chaic-world", "chaic-episodes", "chaic-render"]),
    (
        "chaic",
        &[
            "chaic-protocol",
            "chaic-world",
            "chaic-episodes",
            "chaic-render",
            "chaic-agents",
            "chaic-eval",
            "chaic-import",
            "chaic-llm",
            "chaic-llm-standin",
        ],
    ),
    // What a user writes: a helper, and the one call that evaluates it.
    ("minimal-helper", &["chaic-protocol", "chaic-eval"]),
];

#[test]
fn cargo_run_finds_one_program() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).expect("the root");
    let metadata = ["metadata", "--no-deps", "--offline", "--format-version", "1"];
    let out = Command::new(env!("CARGO")).args(metadata).current_dir(root).output();
    let out = out.expect("cargo runs");
    let told: Value = serde_json::from_slice(&out.stdout).expect("JSON");
    let list = |v: &Value| v.as_array().expect("a list").clone();
    let default = list(&told["workspace_default_members"]);
    let packages = list(&told["packages"]);
    let built = packages.iter().filter(|p| default.contains(&p["id"]));
    let targets = built.flat_map(|p| list(&p["targets"]));
    let programs = targets.filter(|t| t["kind"][0] == "bin");
    assert_eq!(programs.map(|t| t["name"].clone()).collect::<Vec<_>>(), ["chaic"]);
}

#[test]
fn every_dependency_follows_an_arrow() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("crates/");
    let examples = crates.parent().expect("the root").join("examples");
    let folders = [crates, &examples].map(|f| fs::read_dir(f).expect("it can be listed"));
    let mut found = BTreeSet::new();
    for entry in folders.into_iter().flatten() {
        let manifest = entry.expect("an entry").path().join("Cargo.toml");
        let Ok(text) = fs::read_to_string(&manifest) else { continue };
        let name = text
            .lines()
            .find_map(|l| l.strip_prefix("name = "))
            .map(|n| n.trim_matches('"').to_owned())
            .expect("a manifest names its package");
        let (_, allowed) = ALLOWED.iter().find(|(n, _)| *n == name).unwrap_or_else(|| {
            panic!("{name} isn't on the map: add it to ARCHITECTURE.md and here")
        });
        for line in text.lines().filter(|l| l.starts_with("chaic")) {
            let dependency = line.split(['.', ' ', '=']).next().expect("a word");
            assert!(
                dependency == name || allowed.contains(&dependency),
                "{name} may not depend on {dependency}"
            );
        }
        found.insert(name);
    }
    assert_eq!(found.len(), ALLOWED.len(), "the map lists crates that are gone: {found:?}");
}
