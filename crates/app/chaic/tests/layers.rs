//! Promise: no crate reaches past the arrows of ARCHITECTURE.md; agents above all can't see
//! the world or its pictures. And the README's command knows which program is meant.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};

/// A crate with the crates of this workspace that it may depend on, and those that its tests, benches
/// and examples may depend on besides.
struct Arrows {
    of: &'static str,
    to: &'static [&'static str],
    tests_to: &'static [&'static str],
}

const fn arrows(
    of: &'static str,
    to: &'static [&'static str],
    tests_to: &'static [&'static str],
) -> Arrows {
    Arrows { of, to, tests_to }
}

/// The map. ARCHITECTURE.md says why.
const ALLOWED: &[Arrows] = &[
    arrows("chaic-files", &[], &[]),
    arrows("chaic-sandbox", &[], &[]),
    arrows("chaic-core", &[], &[]),
    arrows("chaic-world", &["chaic-core"], &[]),
    arrows("chaic-episodes", &["chaic-core", "chaic-world"], &[]),
    arrows("chaic-render", &["chaic-core", "chaic-world"], &["chaic-episodes", "chaic-test-kit"]),
    arrows("chaic-video", &[], &[]),
    arrows("chaic-nn", &["chaic-core"], &[]),
    arrows("chaic-training", &["chaic-files", "chaic-nn"], &[]),
    arrows(
        "chaic-gltf",
        &["chaic-files", "chaic-core", "chaic-world", "chaic-episodes", "chaic-render"],
        &["chaic-test-kit"],
    ),
    arrows("chaic-test-kit", &["chaic-core", "chaic-world", "chaic-render", "chaic-gltf"], &[]),
    arrows("chaic-render-gpu", &["chaic-core", "chaic-world", "chaic-render"], &["chaic-episodes"]),
    arrows("chaic-goldens", &["chaic-core", "chaic-world", "chaic-episodes", "chaic-render"], &[]),
    arrows("chaic-agents", &["chaic-core"], &[]),
    arrows(
        "chaic-vision",
        &[
            "chaic-files",
            "chaic-core",
            "chaic-world",
            "chaic-episodes",
            "chaic-render",
            "chaic-nn",
            "chaic-training",
            "chaic-agents",
            "chaic-env",
        ],
        &["chaic-eval"],
    ),
    arrows(
        "chaic-env",
        &["chaic-core", "chaic-world", "chaic-episodes", "chaic-render", "chaic-agents"],
        &[],
    ),
    arrows(
        "chaic-eval",
        &[
            "chaic-files",
            "chaic-core",
            "chaic-world",
            "chaic-episodes",
            "chaic-render",
            "chaic-agents",
            "chaic-env",
            "chaic-video",
        ],
        &[],
    ),
    arrows(
        "chaic-learn",
        &[
            "chaic-files",
            "chaic-core",
            "chaic-world",
            "chaic-episodes",
            "chaic-render",
            "chaic-nn",
            "chaic-training",
            "chaic-agents",
            "chaic-env",
            "chaic-vision",
        ],
        &[],
    ),
    arrows(
        "chaic-export",
        &[
            "chaic-files",
            "chaic-core",
            "chaic-world",
            "chaic-episodes",
            "chaic-render",
            "chaic-env",
            "chaic-video",
        ],
        &[],
    ),
    arrows(
        "chaic-fidelity",
        &["chaic-files", "chaic-core", "chaic-env", "chaic-eval"],
        &["chaic-episodes"],
    ),
    arrows(
        "chaic-bench",
        &[
            "chaic-files",
            "chaic-core",
            "chaic-world",
            "chaic-episodes",
            "chaic-render",
            "chaic-gltf",
            "chaic-env",
            "chaic-eval",
        ],
        &[],
    ),
    arrows("chaic-llm-standin", &[], &[]),
    arrows(
        "chaic-llm",
        &["chaic-files", "chaic-core", "chaic-agents", "chaic-env"],
        &["chaic-episodes", "chaic-eval", "chaic-llm-standin"],
    ),
    arrows(
        "chaic-subprocess",
        &[
            "chaic-files",
            "chaic-sandbox",
            "chaic-core",
            "chaic-episodes",
            "chaic-agents",
            "chaic-env",
        ],
        &[],
    ),
    arrows(
        "chaic-import",
        &["chaic-files", "chaic-core", "chaic-world", "chaic-episodes"],
        &["chaic-render"],
    ),
    arrows(
        "chaic",
        &[
            "chaic-files",
            "chaic-core",
            "chaic-episodes",
            "chaic-render",
            "chaic-agents",
            "chaic-vision",
            "chaic-env",
            "chaic-gltf",
            "chaic-eval",
            "chaic-bench",
            "chaic-export",
            "chaic-fidelity",
            "chaic-import",
            "chaic-training",
            "chaic-learn",
            "chaic-llm",
            "chaic-sandbox",
            "chaic-subprocess",
        ],
        &["chaic-llm-standin"],
    ),
    arrows(
        "chaic-python",
        &[
            "chaic",
            "chaic-sandbox",
            "chaic-subprocess",
            "chaic-core",
            "chaic-world",
            "chaic-episodes",
            "chaic-render",
            "chaic-agents",
            "chaic-env",
            "chaic-eval",
            "chaic-vision",
        ],
        &[],
    ),
    // What a user writes: a helper, and the one call that evaluates it.
    arrows("minimal-helper", &["chaic-core", "chaic-env", "chaic-eval"], &[]),
];

fn metadata() -> Value {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).expect("the root");
    let arguments = ["metadata", "--no-deps", "--offline", "--format-version", "1"];
    let out = Command::new(env!("CARGO")).args(arguments).current_dir(root).output();
    serde_json::from_slice(&out.expect("cargo runs").stdout).expect("JSON")
}

fn list(value: &Value) -> &[Value] {
    value.as_array().expect("a list")
}

fn text(value: &Value) -> &str {
    value.as_str().expect("a text")
}

/// What is wrong with the dependencies that `cargo metadata` tells.
fn wrong_arrows(metadata: &Value) -> Vec<String> {
    let packages: BTreeMap<&str, &Value> =
        list(&metadata["packages"]).iter().map(|p| (text(&p["name"]), p)).collect();
    let mut wrong = Vec::new();
    for name in packages.keys().filter(|name| !ALLOWED.iter().any(|a| a.of == **name)) {
        wrong.push(format!("{name} isn't on the map: add it to ARCHITECTURE.md and here"));
    }
    for Arrows { of, to, tests_to } in ALLOWED {
        let Some(package) = packages.get(of) else {
            wrong.push(format!("{of} is on the map, but gone"));
            continue;
        };
        for dependency in list(&package["dependencies"]) {
            let name = text(&dependency["name"]);
            let is_for_tests = dependency["kind"] == "dev";
            let is_allowed = to.contains(&name) || is_for_tests && tests_to.contains(&name);
            if packages.contains_key(name) && !is_allowed {
                let who = if is_for_tests { "the tests of " } else { "" };
                wrong.push(format!("{who}{of} may not depend on {name}"));
            }
        }
    }
    wrong
}

#[test]
fn cargo_run_finds_one_program() {
    let told = metadata();
    let default = list(&told["workspace_default_members"]);
    let built = list(&told["packages"]).iter().filter(|p| default.contains(&p["id"]));
    let targets = built.flat_map(|p| list(&p["targets"]));
    let programs = targets.filter(|t| t["kind"][0] == "bin");
    assert_eq!(programs.map(|t| &t["name"]).collect::<Vec<_>>(), ["chaic"]);
}

/// What a source file says outside of its tests and comments.
fn code(path: &Path) -> String {
    let text = std::fs::read_to_string(path).expect("it can be read");
    let code = text.split("\n#[cfg(test)]\nmod ").next().unwrap_or_default();
    code.lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

/// All source files below a folder, but those of tests.
fn sources(folder: &Path, found: &mut Vec<std::path::PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("it is there").flatten() {
        let path = entry.path();
        let name = entry.file_name().to_string_lossy().into_owned();
        if path.is_dir() && name != "tests" {
            sources(&path, found);
        } else if name.ends_with(".rs") && !name.starts_with("test") {
            found.push(path);
        }
    }
}

/// A ninth task is a row of the table of tasks: whoever makes, steps, plans, scores or draws
/// episodes goes by its columns.
#[test]
fn no_task_is_known_by_its_name() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).expect("the root");
    let crates = [
        "sim/chaic-world",
        "sim/chaic-episodes",
        "sim/chaic-import",
        "render/chaic-render",
        "agents/chaic-agents",
        "agents/chaic-env",
        "agents/chaic-llm",
        "eval/chaic-eval",
    ];
    let names = [
        "NoConstraint",
        "HighTarget",
        "HighContainer",
        "HighGoal",
        "LowTarget",
        "Obstacle",
        "Shopping",
        "MovingHouse",
    ];
    let mut n_files = 0;
    for name in crates {
        let mut found = Vec::new();
        sources(&root.join(format!("crates/{name}/src")), &mut found);
        n_files += found.len();
        for path in found {
            let code = code(&path);
            let known = names.iter().find(|task| code.contains(&format!("TaskId::{task}")));
            // A house to be measured, and one to be imported, begin as one of some task.
            let file = path.to_string_lossy().replace('\\', "/");
            let is_made_of_one = ["episodes/src/house/full.rs", "import/src/house.rs"]
                .iter()
                .any(|f| file.ends_with(f));
            assert!(known.is_none() || is_made_of_one, "{file}: {known:?}");
        }
    }
    assert!(n_files > 100, "{n_files} files");
}

/// The modules of `chaic-agents`, each of which may use only those before it.
const MIND: [&str; 14] = [
    "track",
    "rules",
    "perception",
    "mapping",
    "planning",
    "memory",
    "behavior",
    "decision",
    "policies",
    "execution",
    "child",
    "mind",
    "helpers",
    "partners",
];

/// The modules that code names as `crate::NAME`.
fn named_modules(code: &str) -> Vec<&str> {
    let ends = |c: char| !(c.is_alphanumeric() || c == '_');
    code.split("crate::").skip(1).filter_map(|rest| rest.split(ends).next()).collect()
}

#[test]
fn no_module_of_a_mind_uses_a_later_one() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../agents/chaic-agents/src");
    let mut files = Vec::new();
    sources(&folder, &mut files);
    let rank = |name: &str| MIND.iter().position(|m| *m == name);
    let mut n_uses = 0;
    for file in files {
        let within = file.strip_prefix(&folder).expect("below it");
        let module = within.iter().next().expect("a name").to_string_lossy();
        let Some(own) = rank(module.trim_end_matches(".rs")) else { continue };
        let code = code(&file);
        for used in named_modules(&code).into_iter().filter_map(rank) {
            n_uses += 1;
            let (user, file) = (MIND[own], within.display());
            assert!(used <= own, "{file}: {user} uses {}, which comes later", MIND[used]);
        }
    }
    assert!(n_uses > 50, "{n_uses} uses were found");
}

#[test]
fn every_crate_says_what_it_is() {
    let metadata = metadata();
    let packages = list(&metadata["packages"]);
    assert!(packages.len() > 10);
    for package in packages {
        let name = text(&package["name"]);
        let folder = Path::new(text(&package["manifest_path"])).parent().expect("a folder");
        assert!(
            package["description"].as_str().is_some_and(|d| d.len() > 20),
            "{name}: description"
        );
        let readme = std::fs::read_to_string(folder.join("README.md")).unwrap_or_default();
        assert!(readme.starts_with("# "), "{name}: README.md");
    }
}

#[test]
fn every_dependency_follows_an_arrow() {
    assert_eq!(wrong_arrows(&metadata()), [""; 0]);
}

#[test]
fn a_wrong_arrow_is_found() {
    let with = |of: &str, name: &str, kind: Value| {
        let mut told = metadata();
        let packages = told["packages"].as_array_mut().expect("a list");
        let package = packages.iter_mut().find(|p| p["name"] == of).expect("a crate");
        let dependencies = package["dependencies"].as_array_mut().expect("a list");
        dependencies.push(json!({ "name": name, "kind": kind }));
        wrong_arrows(&told)
    };
    let none: [&str; 0] = [];
    assert_eq!(
        with("chaic-agents", "chaic-world", Value::Null),
        ["chaic-agents may not depend on chaic-world"]
    );
    // Only tests of the renderer draw episodes.
    assert_eq!(with("chaic-render", "chaic-episodes", json!("dev")), none);
    assert_eq!(
        with("chaic-render", "chaic-episodes", Value::Null),
        ["chaic-render may not depend on chaic-episodes"]
    );
    assert_eq!(
        with("chaic-env", "chaic-eval", json!("dev")),
        ["the tests of chaic-env may not depend on chaic-eval"]
    );
}
