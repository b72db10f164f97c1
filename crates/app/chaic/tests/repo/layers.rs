//! Promise: crates depend on each other only along the edges of ARCHITECTURE.md, which lead to the same or an
//! earlier layer. Agents in particular cannot depend on the world or the renderer.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::{cargo_metadata, root, sources};

/// The folders of `crates/` in order. A crate may depend on crates of its own layer and of earlier
/// layers.
const LAYERS: [&str; 7] = ["core", "sim", "render", "agents", "learn", "eval", "app"];
/// The folder of crates that only tests, benches and examples use.
const DEV: &str = "dev";

/// Modules of `chaic-agents`. A module imports only from itself and earlier ones.
const AGENT_MODULES: [&str; 17] = [
    "track",
    "rules",
    "perception",
    "mapping",
    "planning",
    "memory",
    "behavior",
    "perception_factory",
    "belief",
    "decision",
    "execution",
    "team",
    "policies",
    "child",
    "planning_agent",
    "helpers",
    "partners",
];

/// A row of the code map in ARCHITECTURE.md. Names are without `chaic-`.
#[derive(Debug, Default)]
struct Row {
    layer: String,
    /// Dependencies of the library or program.
    uses: BTreeSet<String>,
    /// Further dependencies of tests, benches and examples.
    tests_use: BTreeSet<String>,
}

/// Returns the name of a crate without the prefix of the project.
fn short(name: &str) -> &str {
    name.strip_prefix("chaic-").unwrap_or(name)
}

/// Reads the tables of ARCHITECTURE.md: a heading `### LAYER`, then rows that begin with a crate's name and end with
/// the column "uses", such as `core, world (tests: episodes)`.
fn code_map(text: &str) -> BTreeMap<String, Row> {
    let names = |list: &str| -> BTreeSet<String> {
        list.split(',')
            .map(str::trim)
            .filter(|n| !n.is_empty() && *n != "–")
            .map(Into::into)
            .collect()
    };
    let (mut layer, mut rows) = ("", BTreeMap::new());
    for line in text.lines() {
        if line.starts_with('#') {
            layer = line.strip_prefix("### ").unwrap_or_default().trim();
        }
        let Some((name, _)) = line.strip_prefix("| `").and_then(|rest| rest.split_once("` |"))
        else {
            continue;
        };
        let cells: Vec<&str> = line.trim_matches('|').split('|').collect();
        let uses = cells.last().copied().unwrap_or_default();
        let (uses, notes) = uses.split_once('(').unwrap_or((uses, ""));
        let tests_use = notes.trim().trim_end_matches(')').split_once(':').map_or("", |(_, n)| n);
        let row = Row { layer: layer.into(), uses: names(uses), tests_use: names(tests_use) };
        rows.insert(short(name).to_owned(), row);
    }
    rows
}

fn architecture() -> BTreeMap<String, Row> {
    code_map(&fs::read_to_string(root().join("ARCHITECTURE.md")).expect("the page"))
}

fn metadata() -> Value {
    cargo_metadata(&["--no-deps"])
}

fn list(value: &Value) -> &[Value] {
    value.as_array().expect("a list")
}

fn text(value: &Value) -> &str {
    value.as_str().expect("a text")
}

/// Returns the folder of a package, below the root.
fn folder(package: &Value) -> PathBuf {
    let manifest = Path::new(text(&package["manifest_path"]));
    let folder = manifest.parent().expect("a folder");
    folder.strip_prefix(root()).expect("below the root").to_path_buf()
}

/// Returns the dependencies that break the rules, and the rows that differ from the manifests.
fn wrong_dependencies(metadata: &Value, map: &BTreeMap<String, Row>) -> Vec<String> {
    let crates: BTreeMap<&str, &Value> = list(&metadata["packages"])
        .iter()
        .filter(|package| folder(package).starts_with("crates"))
        .map(|package| (short(text(&package["name"])), package))
        .collect();
    let layer = |name: &str| -> String {
        folder(crates[name]).iter().nth(1).expect("a layer").to_string_lossy().into()
    };
    let rank = |layer: &str| LAYERS.iter().position(|l| *l == layer);
    let mut wrong = Vec::new();
    for name in map.keys().filter(|name| !crates.contains_key(name.as_str())) {
        wrong.push(format!("{name} is in ARCHITECTURE.md, but is no crate"));
    }
    for (name, package) in &crates {
        let own = layer(name);
        let Some(row) = map.get(*name) else {
            wrong.push(format!("{name} is not in ARCHITECTURE.md: add a row below `### {own}`"));
            continue;
        };
        if row.layer != own {
            wrong.push(format!(
                "{name} is in crates/{own}, but in ARCHITECTURE.md in {}",
                row.layer
            ));
        }
        let mut unused = row.uses.clone();
        for dependency in list(&package["dependencies"]) {
            let dependency_name = text(&dependency["name"]);
            let to = short(dependency_name);
            if !dependency_name.starts_with("chaic") || !crates.contains_key(to) {
                continue;
            }
            if dependency["kind"] == "dev" {
                if !row.uses.contains(to) && !row.tests_use.contains(to) {
                    wrong.push(format!("the tests of {name} may not depend on {to}"));
                }
                continue;
            }
            let target = layer(to);
            unused.remove(to);
            if !row.uses.contains(to) {
                wrong.push(format!("{name} may not depend on {to}"));
            } else if own != DEV && (target == DEV || rank(&target) > rank(&own)) {
                wrong.push(format!("{name} in {own} may not depend on {to} in {target}"));
            }
        }
        for to in unused {
            wrong.push(format!("{name} does not use {to}: remove it from ARCHITECTURE.md"));
        }
    }
    wrong
}

#[test]
fn every_dependency_is_in_the_code_map() {
    assert_eq!(wrong_dependencies(&metadata(), &architecture()), [""; 0]);
}

#[test]
fn every_crate_is_in_a_layer() {
    let metadata = metadata();
    for package in list(&metadata["packages"]) {
        let folder = folder(package);
        let layer = folder.strip_prefix("crates").ok().and_then(|within| within.iter().next());
        let layer = layer.map(|l| l.to_string_lossy().into_owned());
        let is_layer = |l: String| l == DEV || LAYERS.contains(&l.as_str());
        assert!(layer.is_none_or(is_layer), "{}: no layer, see LAYERS", folder.display());
    }
}

#[test]
fn a_wrong_dependency_is_found() {
    let map = architecture();
    let with = |from: &str, to: &str, kind: Value, map: &BTreeMap<String, Row>| {
        let mut metadata = metadata();
        let packages = metadata["packages"].as_array_mut().expect("a list");
        let package = packages.iter_mut().find(|p| p["name"] == from).expect("a crate");
        let dependencies = package["dependencies"].as_array_mut().expect("a list");
        dependencies.push(json!({ "name": to, "kind": kind }));
        wrong_dependencies(&metadata, map)
    };
    let none: [&str; 0] = [];
    assert_eq!(
        with("chaic-agents", "chaic-world", Value::Null, &map),
        ["agents may not depend on world"]
    );
    // Only tests of the renderer draw episodes.
    assert_eq!(with("chaic-render", "chaic-episodes", json!("dev"), &map), none);
    assert_eq!(
        with("chaic-render", "chaic-episodes", Value::Null, &map),
        ["render may not depend on episodes"]
    );
    assert_eq!(
        with("chaic-env", "chaic-eval", json!("dev"), &map),
        ["the tests of env may not depend on eval"]
    );
    // The layers forbid this edge even if the code map has a row for it.
    let mut lax = architecture();
    lax.get_mut("env").expect("a row").uses.insert("eval".into());
    assert_eq!(
        with("chaic-env", "chaic-eval", Value::Null, &lax),
        ["env in agents may not depend on eval in eval"]
    );
}

/// A helper in Rust needs few crates.
#[test]
fn the_minimal_helper_uses_four_crates_at_most() {
    let metadata = metadata();
    let packages = list(&metadata["packages"]);
    let example = packages.iter().find(|p| p["name"] == "minimal-helper").expect("the example");
    let names = list(&example["dependencies"]).iter().map(|d| text(&d["name"]));
    let expected = ["chaic-agents", "chaic-core", "chaic-env", "chaic-eval"];
    for name in names.filter(|name| name.starts_with("chaic")) {
        assert!(expected.contains(&name), "{name}");
    }
}

#[test]
fn cargo_run_finds_one_program() {
    let metadata = metadata();
    let default = list(&metadata["workspace_default_members"]);
    let built = list(&metadata["packages"]).iter().filter(|p| default.contains(&p["id"]));
    let targets = built.flat_map(|p| list(&p["targets"]));
    let programs = targets.filter(|t| t["kind"][0] == "bin");
    assert_eq!(programs.map(|t| &t["name"]).collect::<Vec<_>>(), ["chaic"]);
}

/// Returns the code of a source file without its tests and line comments.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).expect("a text");
    let code = text.split("\n#[cfg(test)]\nmod ").next().unwrap_or_default();
    code.lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

/// A new task is a new row of the table of tasks: code reads its columns and names no task.
#[test]
fn no_code_depends_on_the_name_of_a_task() {
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
        sources(&root().join(format!("crates/{name}/src")), &mut found);
        n_files += found.len();
        for path in found {
            let code = code(&path);
            let known = names.iter().find(|task| code.contains(&format!("TaskId::{task}")));
            // These files build a house without a task from the setup of an arbitrary task.
            let file = path.to_string_lossy().replace('\\', "/");
            let is_exempt = ["episodes/src/house/crowded.rs", "import/src/house.rs"]
                .iter()
                .any(|f| file.ends_with(f));
            assert!(known.is_none() || is_exempt, "{file}: {known:?}");
        }
    }
    assert!(n_files > 100, "{n_files} files");
}

/// Faults are injected, and links refused, in `chaic-files` only.
#[test]
fn every_file_is_written_through_chaic_files() {
    let calls = [
        "fs::write(",
        "fs::create_dir",
        "fs::remove_",
        "fs::rename(",
        "fs::copy(",
        "fs::hard_link(",
        "unix::fs::symlink",
        "set_permissions(",
        "tempdir",
        "tempfile(",
        "NamedTempFile",
        "File::create",
        "File::options(",
        "OpenOptions",
    ];
    // Sources with the beginning of the calls that they may contain; docs/reliability.md lists them.
    let exempt = [
        ("core/chaic-files/", ""),
        // Private folders of a helper process, which end with it.
        ("core/chaic-sandbox/", ""),
        // A pipe to the caller.
        ("chaic-python/src/isolated.rs", "File::options("),
        // A new folder among the temporary files of the system; `chaic-files` writes the files in it.
        ("chaic-arena/src/submission.rs", "tempdir"),
    ];
    let mut files = Vec::new();
    for layer in LAYERS {
        sources(&root().join("crates").join(layer), &mut files);
    }
    let (mut n_files, mut is_used) = (0, exempt.map(|_| false));
    for path in files {
        let file = path.to_string_lossy().replace('\\', "/");
        if !file.contains("/src/") {
            continue;
        }
        n_files += 1;
        let code = code(&path);
        let code = code.split("\nmod tests {").next().unwrap_or_default();
        for call in calls.iter().filter(|call| code.contains(**call)) {
            let found =
                exempt.iter().position(|(at, may)| file.contains(at) && call.starts_with(may));
            let found = found.unwrap_or_else(|| panic!("{file}: {call}; use chaic-files"));
            is_used[found] = true;
        }
    }
    assert!(n_files > 200, "{n_files} files");
    assert!(!is_used.contains(&false), "remove the unused exemption: {is_used:?}");
}

/// Returns the modules that code names as `crate::NAME`.
fn named_modules(code: &str) -> Vec<&str> {
    let ends = |c: char| !(c.is_alphanumeric() || c == '_');
    code.split("crate::").skip(1).filter_map(|rest| rest.split(ends).next()).collect()
}

#[test]
fn no_module_of_chaic_agents_uses_a_later_one() {
    let folder = root().join("crates/agents/chaic-agents/src");
    let mut files = Vec::new();
    sources(&folder, &mut files);
    let rank = |name: &str| AGENT_MODULES.iter().position(|m| *m == name);
    let mut n_uses = 0;
    for file in files {
        let within = file.strip_prefix(&folder).expect("below it");
        let module = within.iter().next().expect("a name").to_string_lossy();
        let module = module.trim_end_matches(".rs");
        if module == "lib" {
            continue;
        }
        let own = rank(module);
        let own = own.unwrap_or_else(|| panic!("add {module} to AGENT_MODULES, after all it uses"));
        let code = code(&file);
        for used in named_modules(&code).into_iter().filter_map(rank) {
            n_uses += 1;
            let (user, file) = (AGENT_MODULES[own], within.display());
            assert!(used <= own, "{file}: {user} uses {}, a later module", AGENT_MODULES[used]);
        }
    }
    assert!(n_uses > 50, "only {n_uses} uses were found");
}

#[test]
fn every_crate_has_a_description_and_a_readme() {
    let metadata = metadata();
    let packages = list(&metadata["packages"]);
    assert!(packages.len() > 10);
    for package in packages {
        let name = text(&package["name"]);
        let description = package["description"].as_str();
        assert!(description.is_some_and(|d| d.len() > 20), "{name}: description");
        let readme = root().join(folder(package)).join("README.md");
        let readme = fs::read_to_string(readme).unwrap_or_default();
        assert!(readme.starts_with("# "), "{name}: README.md");
    }
}
