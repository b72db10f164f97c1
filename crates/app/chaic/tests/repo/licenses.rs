//! Promise: all dependencies have a license that `deny.toml` allows, and come from the registry.

use std::process::Command;

use serde_json::Value;
use spdx::{Expression, ParseMode};

use crate::{cargo_metadata, root};

/// Source of the packages on crates.io in `cargo metadata`.
const REGISTRY: &str = "registry+https://github.com/rust-lang/crates.io-index";

#[test]
fn dependencies_have_allowed_licenses_and_come_from_the_registry() {
    let rules = std::fs::read_to_string(root().join("deny.toml")).expect("the file is readable");
    let rules: toml::Table = rules.parse().expect("the file is TOML");
    let allowed = rules["licenses"]["allow"].as_array().expect("a list of licenses");
    let allowed: Vec<&str> = allowed.iter().filter_map(toml::Value::as_str).collect();
    let found = problems(&metadata(), &allowed);
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn other_licenses_and_sources_are_found() {
    let package = |name: &str, license: Value, source: Value| serde_json::json!({"name": name, "license": license, "source": source});
    let registry = || Value::from(REGISTRY);
    let packages = vec![
        package("either", "MIT/GPL-3.0".into(), registry()),
        package("both", "MIT AND GPL-3.0-only".into(), registry()),
        package("unlicensed", Value::Null, registry()),
        package("git", "MIT".into(), "git+https://example.org/x".into()),
        package("member", "MIT".into(), Value::Null),
    ];
    let found = problems(&serde_json::json!({"packages": packages}), &["MIT"]);
    assert_eq!(
        found,
        [
            "both: MIT AND GPL-3.0-only is not allowed by deny.toml",
            "unlicensed: no license",
            "git: comes from git+https://example.org/x",
        ]
    );
}

/// Packages for this platform, all of which are downloaded. `cargo deny` checks those of the others.
fn metadata() -> Value {
    let rustc = Command::new("rustc").arg("-vV").output().expect("rustc starts");
    let version = String::from_utf8(rustc.stdout).expect("rustc writes UTF-8");
    let host = version.lines().find_map(|line| line.strip_prefix("host: ")).expect("a host");
    cargo_metadata(&["--locked", "--filter-platform", host])
}

/// Returns a line for each package whose license or source is not allowed. Members of the workspace have no source.
fn problems(metadata: &Value, allowed: &[&str]) -> Vec<String> {
    let packages = metadata["packages"].as_array().expect("a list of packages");
    let problem = |package: &Value| {
        let name = package["name"].as_str().expect("packages have names");
        if let Some(source) = package["source"].as_str().filter(|source| *source != REGISTRY) {
            return Some(format!("{name}: comes from {source}"));
        }
        let Some(license) = package["license"].as_str() else {
            return Some(format!("{name}: no license"));
        };
        let is_allowed = Expression::parse_mode(license, ParseMode::LAX).is_ok_and(|license| {
            license.evaluate(|required| allowed.contains(&&*required.to_string()))
        });
        (!is_allowed).then(|| format!("{name}: {license} is not allowed by deny.toml"))
    };
    packages.iter().filter_map(problem).collect()
}
